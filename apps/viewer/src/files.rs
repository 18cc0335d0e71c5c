//! A small window to choose a file in: folders, files of the wanted kinds, a name. It needs nothing of the system.

use std::path::{Path, PathBuf};

use egui::{Align2, Key, ScrollArea, TextEdit, Ui};

use crate::style;

/// What a file is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A fabric to look at.
    OpenFabric,
    /// A measurement to lay over the plot.
    OpenMeasurement,
    /// Where the fabric goes.
    SaveFabric,
    /// Where the picture goes.
    SavePicture,
}

impl Purpose {
    /// The window's title.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::OpenFabric => "Open a fabric",
            Self::OpenMeasurement => "Open a measurement",
            Self::SaveFabric => "Save the fabric",
            Self::SavePicture => "Save the picture",
        }
    }
    const fn verb(self) -> &'static str {
        if self.saves() { "Save" } else { "Open" }
    }
    /// Whether a file is written.
    #[must_use]
    pub const fn saves(self) -> bool {
        matches!(self, Self::SaveFabric | Self::SavePicture)
    }
    /// The ends of names that are shown.
    #[must_use]
    pub const fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::OpenFabric | Self::SaveFabric => &["toml"],
            Self::OpenMeasurement => &["xml", "csv"],
            Self::SavePicture => &["png"],
        }
    }
}

/// The window.
#[derive(Clone, Debug)]
pub struct Chooser {
    /// What for.
    pub purpose: Purpose,
    folder: PathBuf,
    name: String,
    /// (name, is a folder)
    entries: Result<Vec<(String, bool)>, String>,
    asked: bool,
}

/// How the window was left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// It is still open.
    Open,
    /// It was closed without a choice.
    Cancelled,
    /// This file.
    File(PathBuf),
}

impl Chooser {
    /// Opens the window in `folder` with a name to begin with.
    #[must_use]
    pub fn new(purpose: Purpose, folder: &Path, name: &str) -> Self {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let mut chooser = Self {
            purpose,
            folder,
            name: name.to_owned(),
            entries: Ok(Vec::new()),
            asked: false,
        };
        chooser.list();
        chooser
    }

    /// The folder shown.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn list(&mut self) {
        let wanted = |name: &str| {
            let end = Path::new(name)
                .extension()
                .and_then(|e| e.to_str())
                .unwrap_or_default()
                .to_ascii_lowercase();
            self.purpose.extensions().contains(&end.as_str())
        };
        self.entries = std::fs::read_dir(&self.folder)
            .map(|dir| {
                let mut entries: Vec<_> = dir
                    .filter_map(Result::ok)
                    .map(|e| {
                        (
                            e.file_name().to_string_lossy().into_owned(),
                            e.path().is_dir(),
                        )
                    })
                    .filter(|(name, folder)| !name.starts_with('.') && (*folder || wanted(name)))
                    .collect();
                entries.sort_by_key(|(name, folder)| (!folder, name.to_lowercase()));
                entries
            })
            .map_err(|e| format!("{} cannot be listed: {e}", self.folder.display()));
    }

    fn enter(&mut self, folder: PathBuf) {
        self.folder = folder;
        self.asked = false;
        self.list();
    }

    /// The file that the fields name, with the purpose's extension when a file to save has none.
    fn file(&self) -> PathBuf {
        let path = self.folder.join(self.name.trim());
        if self.purpose.saves() && path.extension().is_none() {
            return path.with_extension(self.purpose.extensions()[0]);
        }
        path
    }

    /// Shows the window.
    pub fn show(&mut self, ctx: &egui::Context) -> Choice {
        let mut open = true;
        let mut choice = Choice::Open;
        egui::Window::new(self.purpose.title())
            .open(&mut open)
            .collapsible(false)
            .resizable(true)
            .default_size([520.0, 380.0])
            .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
            .show(ctx, |ui| choice = self.inside(ui));
        if !open || ctx.input(|i| i.key_pressed(Key::Escape)) {
            return Choice::Cancelled;
        }
        choice
    }

    fn inside(&mut self, ui: &mut Ui) -> Choice {
        let mut chosen = false;
        ui.horizontal(|ui| {
            if let Some(parent) = self.folder.parent().map(Path::to_owned)
                && ui
                    .button("Up")
                    .on_hover_text("To the folder above")
                    .clicked()
            {
                self.enter(parent);
            }
            ui.add(egui::Label::new(style::weak(self.folder.display().to_string())).truncate());
        });
        let mut entered = None;
        ScrollArea::vertical()
            .max_height(250.0)
            .min_scrolled_height(250.0)
            .auto_shrink([false, false])
            .show(ui, |ui| match &self.entries {
                Err(told) => {
                    ui.colored_label(style::WRONG, told);
                }
                Ok(entries) if entries.is_empty() => {
                    ui.label(style::weak(format!(
                        "No .{} here.",
                        self.purpose.extensions().join(" or .")
                    )));
                }
                Ok(entries) => {
                    for (name, folder) in entries {
                        let shown = if *folder {
                            format!("{name}/")
                        } else {
                            name.clone()
                        };
                        let row = ui.selectable_label(!folder && *name == self.name, shown);
                        if row.clicked() && *folder {
                            entered = Some(self.folder.join(name));
                        } else if row.clicked() {
                            self.name.clone_from(name);
                            self.asked = false;
                        }
                        chosen |= row.double_clicked() && !folder;
                    }
                }
            });
        if let Some(folder) = entered {
            self.enter(folder);
        }
        let mut cancelled = false;
        ui.horizontal(|ui| {
            let label = ui.label("File");
            let width = ui.available_width() - 150.0;
            let field = ui
                .add(TextEdit::singleline(&mut self.name).desired_width(width))
                .labelled_by(label.id);
            self.asked &= !field.changed();
            chosen |= field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            chosen |= ui
                .button(if self.asked {
                    "Replace"
                } else {
                    self.purpose.verb()
                })
                .clicked();
            cancelled = ui.button("Cancel").clicked();
        });
        if self.asked {
            ui.colored_label(style::WRONG, "There is such a file already.");
        }
        if cancelled {
            return Choice::Cancelled;
        }
        if !chosen || self.name.trim().is_empty() {
            return Choice::Open;
        }
        let file = self.file();
        if file.is_dir() {
            self.enter(file);
            self.name.clear();
            return Choice::Open;
        }
        if self.purpose.saves() && file.exists() && !self.asked {
            self.asked = true;
            return Choice::Open;
        }
        Choice::File(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_come_first_and_other_files_are_not_shown() {
        let assets = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets"));
        let chooser = Chooser::new(Purpose::OpenMeasurement, assets, "");
        let entries = chooser.entries.clone().expect("it is there");
        assert!(
            entries
                .iter()
                .any(|(n, folder)| n == "measurements" && *folder)
        );
        assert!(!entries.iter().any(|(n, _)| n == "catalog.toml"));
        let inside = Chooser::new(Purpose::OpenMeasurement, &assets.join("measurements"), "");
        let names: Vec<_> = inside
            .entries
            .expect("it is there")
            .into_iter()
            .map(|(n, _)| n)
            .collect();
        assert!(
            names.contains(&"mecho_6216_goniometer.xml".to_owned())
                && !names.contains(&"README.md".to_owned())
        );
    }

    #[test]
    fn a_saved_file_gets_its_extension_and_a_missing_folder_is_told() {
        let chooser = Chooser::new(Purpose::SavePicture, Path::new("/"), "window");
        assert_eq!(chooser.file(), Path::new("/window.png"));
        let nowhere = Chooser::new(
            Purpose::OpenFabric,
            Path::new("/there/is/no/such/folder"),
            "",
        );
        assert!(nowhere.entries.is_err_and(|e| e.contains("no/such/folder")));
    }
}
