//! What the window opens and saves; every failure becomes a sentence in it.

use std::path::Path;

use super::{Message, Viewer};
use crate::cloth::Cloth;
use crate::files::{Choice, Chooser, Purpose};
use crate::measurement::Measurement;

impl Viewer {
    /// Shows another fabric, or tells why not.
    pub fn open_fabric(&mut self, path: &Path) {
        match Cloth::open(path) {
            Ok(cloth) => {
                self.cloth = cloth;
                if !self.fabrics.iter().any(|f| f == path) {
                    self.fabrics.push(path.to_owned());
                }
                self.cloth_changed();
            }
            Err(told) => self.tell(told.to_string(), true),
        }
    }

    /// Lays a measurement over the plot, or tells why not.
    pub fn open_measurement(&mut self, path: &Path) {
        match Measurement::open(path) {
            Ok(measurement) => {
                self.measurement = Some(measurement);
                path.clone_into(&mut self.measured_from);
                self.fitting = None;
            }
            Err(told) => self.tell(told.to_string(), true),
        }
    }

    /// Opens whatever the file is, by its name's end.
    pub fn open(&mut self, path: &Path) {
        match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("toml") => self.open_fabric(path),
            Some("xml" | "csv") => self.open_measurement(path),
            _ => self.tell(
                format!(
                    "{} is neither a fabric (.toml) nor a measurement (.xml, .csv).",
                    path.display()
                ),
                true,
            ),
        }
    }

    pub(crate) fn choose_file(&mut self, purpose: Purpose) {
        let name = match purpose {
            Purpose::SaveFabric => format!("{}.toml", file_name(self.cloth.name())),
            Purpose::SavePicture => format!("{}.png", file_name(self.cloth.name())),
            Purpose::OpenFabric | Purpose::OpenMeasurement => String::new(),
        };
        self.chooser = Some(Chooser::new(purpose, &self.folder, &name));
    }

    pub(crate) fn show_chooser(&mut self, ctx: &egui::Context) {
        let Some(chooser) = &mut self.chooser else {
            return;
        };
        let choice = chooser.show(ctx);
        let (purpose, folder) = (chooser.purpose, chooser.folder().to_owned());
        match choice {
            Choice::Open => return,
            Choice::Cancelled => {}
            Choice::File(path) => match purpose {
                Purpose::OpenFabric => self.open_fabric(&path),
                Purpose::OpenMeasurement => self.open_measurement(&path),
                Purpose::SaveFabric => self.save_fabric(&path),
                Purpose::SavePicture => self.save_picture(&path),
            },
        }
        self.folder = folder;
        self.chooser = None;
    }

    /// Whether the file window is open, so that keys belong to it.
    pub(crate) fn choosing(&self) -> bool {
        self.chooser.is_some()
    }

    /// Writes the fabric as the sliders stand.
    pub fn save_fabric(&mut self, path: &Path) {
        let name = path.file_stem().map_or_else(
            || self.cloth.name().to_owned(),
            |n| n.to_string_lossy().into_owned(),
        );
        let name = if name == file_name(self.cloth.name()) {
            self.cloth.name().to_owned()
        } else {
            name
        };
        let text = self.cloth.fabric(&name).to_toml();
        let written = woven_render::atomic::write_atomically(path, |out| {
            use std::io::Write;
            Ok(out.write_all(text.as_bytes())?)
        });
        // The map first would leave a picture that nobody names, if the fabric could not be written.
        let pattern = self.cloth.pattern.as_ref();
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        let written = written.and_then(|()| pattern.map_or(Ok(()), |map| map.copy_to(folder)));
        match written {
            Ok(()) => self.tell(format!("The fabric is saved as {}.", path.display()), false),
            Err(told) => self.tell(format!("{told:#}"), true),
        }
    }

    /// Writes the picture as it is on the screen, in a thread of its own.
    pub fn save_picture(&mut self, path: &Path) {
        let Some(print) = self.view.print.clone() else {
            self.tell("There is no picture to save yet; wait a second.", true);
            return;
        };
        let (path, letters) = (path.to_owned(), self.letters.0.clone());
        let write = move || {
            let written =
                woven_render::film::write_png8(&path, print.size[0], print.size[1], &print.rgb);
            let message = match written {
                Ok(()) => Message {
                    text: format!("The picture is saved as {}.", path.display()),
                    wrong: false,
                },
                Err(told) => Message {
                    text: format!("{told:#}"),
                    wrong: true,
                },
            };
            letters.send(message).ok();
        };
        if let Err(e) = std::thread::Builder::new()
            .name("save".to_owned())
            .spawn(write)
        {
            self.tell(format!("The picture cannot be saved: {e}"), true);
        }
    }
}

/// A name that every file system takes.
fn file_name(name: &str) -> String {
    let plain: String = name
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || c == '-' {
                c.to_ascii_lowercase()
            } else {
                '-'
            }
        })
        .collect();
    let parts: Vec<_> = plain.split('-').filter(|p| !p.is_empty()).collect();
    if parts.is_empty() {
        "fabric".to_owned()
    } else {
        parts.join("-")
    }
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn file_names_are_plain() {
        assert_eq!(
            file_name("Satine 5500 5 %, White Pearl"),
            "satine-5500-5-white-pearl"
        );
        assert_eq!(file_name("../../etc"), "etc");
        assert_eq!(file_name("%"), "fabric");
    }
}
