//! Proofs of the optics: loops over every model of the list, and numbers known from elsewhere.

mod albedo;
mod damage;
mod derivatives;
mod descriptions;
mod drafts;
mod energy;
mod formats;
mod fuzz;
mod klems;
mod made;
mod published;
mod readers;
mod reciprocity;
mod rgl;
mod sampling;
mod sheen;
mod shop;
mod support;
mod table;
mod trees;
mod weave;
mod yarns;
