//! Shared by the tests.

/// A temporary folder in memory where the system has one: tests on virtual time are about the log's contents, not about how fast a disk syncs.
pub(crate) fn quick_folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm")
        .or_else(|_| tempfile::tempdir())
        .unwrap()
}
