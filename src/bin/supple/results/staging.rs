//! A folder of results that is replaced as a whole. The new one is made in `.NAME.run/new`, next to the folder `NAME`,
//! and takes its place when it is complete: a process that is killed, or a full disk, leaves the old folder or the new
//! one. The next process removes what a killed one left. Files in the old folder that are nobody's results move into
//! the new one.
//!
//! The places are exchanged in one operation where the system and the file system have one (Linux and macOS; not NFS).
//! Elsewhere the old folder is renamed first; if the process is killed just then, there is no folder until the next one
//! puts the old back.
//!
//! `.NAME.run/lock` is locked all the while, so that two processes do not write into one folder.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use crate::problem::Problem;

/// Tries to lock while other processes come and go.
const ATTEMPTS: u32 = 100;

/// A new folder that is not in its place yet.
pub(crate) struct Staging {
    /// The folder that is replaced.
    place: PathBuf,
    hidden: PathBuf,
    /// Whether a file of this name is a result, which may be removed.
    is_result: fn(&OsStr) -> bool,
    force: bool,
    /// Whether a new folder that is not in its place is worth keeping: it is complete.
    complete: bool,
    _lock: File,
}

impl Staging {
    /// Makes an empty folder that may take the place of `path`; one that is there is refused unless `force`.
    pub(crate) fn open(path: &Path, force: bool, is_result: fn(&OsStr) -> bool) -> Result<Self, Problem> {
        // Without a separator at the end, with which a link would not be seen as one.
        let path = &path.components().collect::<PathBuf>();
        if path.exists() && !path.is_dir() {
            return Err(Problem::in_file(path, "is a file; results need a folder"));
        }
        // A link stays, and what it points to is replaced.
        let place = if path.is_symlink() { fs::canonicalize(path) } else { Ok(path.to_path_buf()) };
        let place = place.map_err(|error| cannot_make(path, &error))?;
        let name = place
            .file_name()
            .ok_or_else(|| Problem::in_file(path, "is not the name of a folder; results replace one as a whole"))?;
        let mut hidden = OsString::from(".");
        hidden.push(name);
        hidden.push(".run");
        let hidden = place.with_file_name(hidden);
        if let Some(parent) = place.parent() {
            fs::create_dir_all(parent).map_err(|error| cannot_make(parent, &error))?;
        }
        if is_mount_point(&place) {
            return Err(Problem::in_file(path, "is a mount point, which cannot be replaced; name a folder in it"));
        }
        let lock = lock(&hidden).map_err(|error| cannot_make(&hidden, &error))?;
        let lock = lock.ok_or_else(|| {
            Problem::in_file(path, format!("another run writes there and holds {}", lock_of(&hidden).display()))
        })?;
        let staging = Self { place, hidden, is_result, force, complete: false, _lock: lock };
        staging.recover()?;
        // Only now: the folder may be back in its place.
        if path.exists() && !force {
            return Err(Problem::in_file(path, "is there already; --force overwrites the results in it"));
        }
        fs::create_dir(staging.folder()).map_err(|error| cannot_make(&staging.folder(), &error))?;
        Ok(staging)
    }

    /// The new folder, until it is in its place.
    pub(crate) fn folder(&self) -> PathBuf {
        self.hidden.join("new")
    }

    /// The old folder, where the two cannot be exchanged.
    fn old(&self) -> PathBuf {
        self.hidden.join("old")
    }

    /// Puts the new folder, which is complete, into its place.
    pub(crate) fn publish(mut self) -> Result<(), Problem> {
        self.synchronise()?;
        self.complete = true;
        self.put_in_place().map_err(|error| {
            let new = self.folder();
            let new = new.display();
            Problem::in_file(
                &self.place,
                format!("cannot be replaced: {error}; move the results from {new} before the next run"),
            )
        })?;
        self.complete = false;
        self.recover()
    }

    /// Waits until the files are on the disk: otherwise a power cut might leave the new folder in its place with files
    /// that are empty.
    fn synchronise(&self) -> Result<(), Problem> {
        let folder = self.folder();
        for entry in fs::read_dir(&folder).map_err(|error| cannot_read(&folder, &error))? {
            let path = entry.map_err(|error| cannot_read(&folder, &error))?.path();
            if path.is_file() {
                let file = File::options().write(true).open(&path);
                file.and_then(|file| file.sync_all())
                    .map_err(|error| Problem::in_file(&path, format!("cannot be written: {error}")))?;
            }
        }
        Ok(())
    }

    fn put_in_place(&self) -> io::Result<()> {
        let (new, old) = (self.folder(), self.old());
        let Ok(before) = fs::metadata(&self.place) else {
            return fs::rename(new, &self.place);
        };
        if !self.force {
            return Err(io::Error::new(ErrorKind::AlreadyExists, "it was made meanwhile"));
        }
        fs::set_permissions(&new, before.permissions())?;
        if exchange(&new, &self.place).is_ok() {
            return Ok(());
        }
        fs::rename(&self.place, &old)?;
        fs::rename(&new, &self.place).inspect_err(|_| {
            // The error to report is the first.
            let _ = fs::rename(&old, &self.place);
        })
    }

    /// Brings an old folder back that lost its place, and removes results that have none.
    fn recover(&self) -> Result<(), Problem> {
        if self.old().exists() && !self.place.exists() {
            fs::rename(self.old(), &self.place).map_err(|error| cannot_make(&self.place, &error))?;
        }
        for folder in [self.folder(), self.old()] {
            if folder.exists() {
                self.rescue(&folder)?;
                fs::remove_dir_all(&folder)
                    .map_err(|error| Problem::in_file(&folder, format!("cannot be removed: {error}")))?;
            }
        }
        Ok(())
    }

    /// Moves files and folders that are not results to where they were.
    fn rescue(&self, folder: &Path) -> Result<(), Problem> {
        for entry in fs::read_dir(folder).map_err(|error| cannot_read(folder, &error))? {
            let name = entry.map_err(|error| cannot_read(folder, &error))?.file_name();
            if (self.is_result)(&name) {
                continue;
            }
            let (from, to) = (folder.join(&name), self.place.join(&name));
            let moved = if to.exists() { Err(ErrorKind::AlreadyExists.into()) } else { fs::rename(&from, &to) };
            moved.map_err(|error| Problem::in_file(&from, format!("cannot be moved to {}: {error}", to.display())))?;
        }
        Ok(())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        // The next run reports what cannot be removed now. A complete folder stays.
        let tidy = self.complete || self.recover().is_ok();
        // The lock last, so that another run begins with nothing there.
        if cfg!(unix) && tidy {
            let _ = fs::remove_file(lock_of(&self.hidden));
        }
        let _ = fs::remove_dir(&self.hidden);
    }
}

fn lock_of(hidden: &Path) -> PathBuf {
    hidden.join("lock")
}

/// Makes the hidden folder and locks it; none if another process has.
fn lock(hidden: &Path) -> io::Result<Option<File>> {
    let path = lock_of(hidden);
    for _ in 0..ATTEMPTS {
        match fs::create_dir(hidden) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
        let file = match File::options().write(true).create(true).truncate(false).open(&path) {
            // A process that ended just now took the folder with it.
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            file => file?,
        };
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(error)) => return Err(error),
            // Or it took the file, and this lock is nobody's hindrance.
            Ok(()) if is_at(&file, &path) => return Ok(Some(file)),
            Ok(()) => {}
        }
    }
    Err(io::Error::other("it comes and goes"))
}

/// Whether another file system begins here. Renaming would fail, after all the time of the run.
#[cfg(unix)]
fn is_mount_point(place: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let device = |path: &Path| fs::metadata(path).map(|metadata| metadata.dev()).ok();
    device(place).is_some_and(|own| device(&place.join("..")).is_some_and(|parent| parent != own))
}

#[cfg(not(unix))]
fn is_mount_point(_: &Path) -> bool {
    false
}

/// Whether the path still leads to the file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    file.metadata().ok().map(identity) == fs::metadata(path).ok().map(identity)
}

/// The lock is never removed there.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn exchange(new: &Path, place: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, new, CWD, place, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(ErrorKind::Unsupported.into())
}

fn cannot_read(path: &Path, error: &io::Error) -> Problem {
    Problem::in_file(path, format!("cannot be read: {error}"))
}

fn cannot_make(path: &Path, error: &io::Error) -> Problem {
    Problem::in_file(path, format!("cannot be made: {error}"))
}
