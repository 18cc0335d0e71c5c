//! Output that is either whole or not there: written beside its final name, synced, then renamed.

use anyhow::{Context, Result};
use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes a file by way of a temporary one in the same folder.
///
/// `fill` gets a buffered writer that can also seek. The old file, if any, stays as it was until the new one is
/// complete and synced; when anything fails the temporary file is removed.
///
/// # Errors
/// A sentence naming the file when the folder cannot be written, `fill` fails, or the disk is full.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&fs::File>) -> Result<()>,
) -> Result<()> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let temp = tempfile::Builder::new().prefix(".woven-").suffix(".part").tempfile_in(folder).with_context(|| {
        format!(
            "cannot write {}: the folder {} does not take a new file; does it exist and is it writable?",
            path.display(),
            folder.display()
        )
    })?;
    let told = || format!("writing {} failed; is the disk full?", path.display());
    {
        let mut out = BufWriter::with_capacity(1 << 18, temp.as_file());
        fill(&mut out).with_context(told)?;
        out.flush().with_context(told)?;
    }
    temp.as_file().sync_all().with_context(told)?;
    open_to_all(temp.as_file());
    temp.persist(path)
        .map_err(|e| e.error)
        .with_context(|| format!("cannot put {} in its place", path.display()))?;
    // The rename itself is made durable by syncing the folder; where folders cannot be opened (Windows) it is skipped.
    if let Ok(dir) = fs::File::open(folder) {
        dir.sync_all().ok();
    }
    Ok(())
}

/// A temporary file is private to its owner; the finished one gets the usual rights (rw-r--r--).
#[cfg(unix)]
fn open_to_all(file: &fs::File) {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o644)).ok();
}

#[cfg(not(unix))]
fn open_to_all(_file: &fs::File) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_litter() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomically(&path, |w| Ok(w.write_all(b"old")?)).unwrap();
        let err = write_atomically(&path, |w| {
            w.write_all(b"half of the new")?;
            anyhow::bail!("the source broke off")
        });
        assert!(format!("{:#}", err.unwrap_err()).contains("the source broke off"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let err = write_atomically(Path::new("no/such/folder/a.exr"), |_| Ok(())).unwrap_err();
        assert!(format!("{err:#}").contains("no/such/folder"), "{err:#}");
    }
}
