//! The output folder: every product is written whole or not at all, and beside it a key that tells what it was made from.
//!
//! A product counts as done when its key file names the wanted key and the hash of the very bytes that are there. The product is
//! written first and the key last, each to a temporary file that is renamed, so a run killed at any moment leaves nothing half done.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use sha2::{Digest as _, Sha256};

/// Folder of the key files inside the output folder.
const KEYS: &str = "work/keys";

/// What a product is made from, as a hash of named inputs and of the version of this program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key(String);

impl Key {
    /// The key of a product of this `kind` made from `inputs`, in this order.
    #[must_use]
    pub fn new(kind: &str, inputs: &[(&str, &str)]) -> Self {
        let mut hash = Sha256::new();
        for (name, value) in [("kind", kind), ("version", version())]
            .iter()
            .chain(inputs)
        {
            // Lengths keep ("ab", "c") apart from ("a", "bc").
            hash.update(format!("{}:{name}={}:{value};", name.len(), value.len()));
        }
        Self(hex(&hash.finalize()))
    }

    /// The hash in hexadecimal.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.0
    }
}

/// The version of this program with a hash of its sources.
#[must_use]
pub const fn version() -> &'static str {
    concat!(env!("CARGO_PKG_VERSION"), "+", env!("WOVEN_SOURCES"))
}

/// The SHA-256 of `bytes` in hexadecimal.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// An output folder.
#[derive(Clone, Debug)]
pub struct Store {
    root: PathBuf,
}

impl Store {
    /// Opens the folder, making it if it is not there, and makes sure that it can be written.
    ///
    /// # Errors
    /// A sentence that names the folder.
    pub fn open(root: &Path) -> Result<Self> {
        let explain = || {
            format!(
                "The output folder {} cannot be written; choose another one with -o.",
                root.display()
            )
        };
        fs::create_dir_all(root.join(KEYS)).with_context(explain)?;
        tempfile::NamedTempFile::new_in(root).with_context(explain)?;
        Ok(Self {
            root: root.to_owned(),
        })
    }

    /// The place of a product, `name` with slashes.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    fn key_path(&self, name: &str) -> PathBuf {
        self.root
            .join(KEYS)
            .join(format!("{}.key", name.replace('/', "--")))
    }

    /// The bytes of a product, if it is there, whole, and was made from what `key` says.
    #[must_use]
    pub fn get(&self, name: &str, key: &Key) -> Option<Vec<u8>> {
        let note = fs::read_to_string(self.key_path(name)).ok()?;
        let (made_from, hash) = note.trim_end().split_once(' ')?;
        if made_from != key.0 {
            return None;
        }
        let bytes = fs::read(self.path(name)).ok()?;
        (sha256(&bytes) == hash).then_some(bytes)
    }

    /// Writes a product, then its key.
    ///
    /// # Errors
    /// When the disk is full or the folder cannot be written.
    pub fn put(&self, name: &str, key: &Key, bytes: &[u8]) -> Result<()> {
        self.write(&self.path(name), bytes)?;
        self.write(
            &self.key_path(name),
            format!("{} {}\n", key.0, sha256(bytes)).as_bytes(),
        )
    }

    /// Temporary file in the same folder, bytes, fsync, rename, fsync of the folder.
    fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        let explain = || {
            format!(
                "{} cannot be written; is the disk full or the folder read-only?",
                path.display()
            )
        };
        let folder = path.parent().unwrap_or(&self.root);
        fs::create_dir_all(folder).with_context(explain)?;
        let mut file = tempfile::Builder::new()
            .prefix(".part-")
            .suffix(".tmp")
            .tempfile_in(folder)
            .with_context(explain)?;
        file.write_all(bytes).with_context(explain)?;
        file.as_file().sync_all().with_context(explain)?;
        open_to_all(file.as_file()).with_context(explain)?;
        file.persist(path)
            .map_err(|e| e.error)
            .with_context(explain)?;
        // The rename itself is safe once the folder is on the disk; where a folder cannot be opened (Windows) there is no such call.
        if let Ok(folder) = fs::File::open(folder) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

/// Temporary files are private; a page is for everybody to read.
#[cfg(unix)]
fn open_to_all(file: &fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    file.set_permissions(fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn open_to_all(_: &fs::File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_counts_only_whole_and_for_its_key() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let (key, other) = (
            Key::new("frame", &[("n", "1")]),
            Key::new("frame", &[("n", "2")]),
        );
        assert_eq!(store.get("a/1.png", &key), None);
        store.put("a/1.png", &key, b"picture").unwrap();
        assert_eq!(store.get("a/1.png", &key).as_deref(), Some(&b"picture"[..]));
        assert_eq!(
            store.get("a/1.png", &other),
            None,
            "made from something else"
        );
        fs::write(store.path("a/1.png"), b"pict").unwrap();
        assert_eq!(store.get("a/1.png", &key), None, "torn");
    }

    #[test]
    fn a_product_without_its_key_does_not_count() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path()).unwrap();
        let key = Key::new("frame", &[]);
        store.put("1.png", &key, b"picture").unwrap();
        fs::remove_file(store.key_path("1.png")).unwrap();
        assert_eq!(store.get("1.png", &key), None);
    }

    #[test]
    fn keys_tell_inputs_apart() {
        assert_ne!(Key::new("k", &[("ab", "c")]), Key::new("k", &[("a", "bc")]));
        assert_ne!(Key::new("k", &[("a", "1")]), Key::new("l", &[("a", "1")]));
        assert_eq!(Key::new("k", &[("a", "1")]), Key::new("k", &[("a", "1")]));
    }
}
