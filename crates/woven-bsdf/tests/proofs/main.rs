//! Proofs of the optics: loops over every model of the list, and numbers known from elsewhere.

mod albedo;
mod derivatives;
mod drafts;
mod energy;
mod fuzz;
mod published;
mod readers;
mod reciprocity;
mod sampling;
mod shop;
mod support;
mod table;
mod weave;
