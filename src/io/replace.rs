//! Files that are replaced as a whole: written under a temporary name in the same folder, then renamed, so that a
//! process that is killed, or a full disk, leaves the old file or the new one.
//!
//! The temporary file of `NAME` is `.NAME.PROCESS-COUNT.tmp`. It is locked while it is written; what a killed process
//! left behind is not, and goes when a file of that name is written again.

use core::sync::atomic::{AtomicU32, Ordering};
use std::ffi::{OsStr, OsString};
use std::format;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::write::invalid;

/// Writes a file so that no reader ever sees half of it: under a temporary name in the same folder, then renamed. If
/// `write` or the file system fails, the temporary file is removed and a file of that name stays as it was. If the
/// process is killed, the file stays as it was, and the next call for it removes the temporary one. The bytes are on
/// the disk before they have the file's name, so that a power cut leaves no empty file.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    replace(path, true, write)
}

/// The same, on the disk (`synchronise`) or not yet: the files of a series are synchronised together, which takes a
/// fortieth of the time.
pub(super) fn replace(
    path: &Path,
    synchronise: bool,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let name = path.file_name().ok_or_else(|| invalid(format!("{} is not the name of a file", path.display())))?;
    let named =
        |error: io::Error| io::Error::new(error.kind(), format!("{}: cannot be written: {error}", path.display()));
    remove_abandoned(path, name);
    let (file, temporary) = create_temporary(path, name).map_err(named)?;
    // Open, and so locked, until it has its name.
    let mut file = BufWriter::new(file);
    let written = write(&mut file).and_then(|()| file.flush());
    let written = written.and_then(|()| if synchronise { file.get_ref().sync_all() } else { Ok(()) });
    written.and_then(|()| fs::rename(&temporary, path)).map_err(|error| {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
        named(error)
    })
}

/// A temporary file that is ours and, where the file system has locks, locked.
fn create_temporary(path: &Path, name: &OsStr) -> io::Result<(File, PathBuf)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    loop {
        let mut temporary = prefix(name);
        temporary.push(format!("{}-{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
        let temporary = path.with_file_name(temporary);
        let file = match File::create_new(&temporary) {
            // Left behind by a process that had our number.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            file => file?,
        };
        // Before it was locked, another process may have taken it for an abandoned one.
        let locked = !matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        if locked && temporary.try_exists()? {
            return Ok((file, temporary));
        }
    }
}

/// Removes the temporary files of this name that nobody writes any more.
fn remove_abandoned(path: &Path, name: &OsStr) {
    let prefix = prefix(name);
    // The file itself is written without this, so no error of it matters.
    let Ok(entries) = fs::read_dir(path.with_file_name(".")) else { return };
    for entry in entries.flatten() {
        let found = entry.file_name();
        let rest = found.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes());
        let number = rest.and_then(|rest| rest.strip_suffix(b".tmp")).unwrap_or_default();
        if !number.is_empty() && number.iter().all(|byte| byte.is_ascii_digit() || *byte == b'-') {
            // Locked until it is removed: whoever has just created it finds it locked, or gone.
            let Ok(file) = File::options().write(true).open(entry.path()) else { continue };
            if file.try_lock().is_ok() {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

/// How the names of a file's temporary files begin.
fn prefix(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(".");
    prefix
}
