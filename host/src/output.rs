//! Files that are there in full or not at all.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use tempfile::NamedTempFile;

use crate::error::Error;
use crate::options::folder;

/// Writes files: each to a temporary one in its own folder first, and only when all of them are complete are they given
/// their names. A failure before that leaves nothing behind.
///
/// # Errors
/// If a folder cannot be written to or has no room.
pub fn write_all(files: &[(PathBuf, Vec<u8>)]) -> Result<(), Error> {
    let fault = |path: &PathBuf, source| Error::Write { path: path.clone(), source };
    let mut ready = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        let mut file = temporary(path).map_err(|e| fault(path, e))?;
        file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(|e| fault(path, e))?;
        ready.push((path, file));
    }
    for (path, file) in ready {
        file.persist(path).map_err(|e| fault(path, e.error))?;
    }
    Ok(())
}

/// Writes a file that is not there yet, in full or not at all.
///
/// # Errors
/// [`Error::Exists`] if it is there, or if the folder cannot be written to or has no room.
pub fn write_new(path: &PathBuf, bytes: &[u8]) -> Result<(), Error> {
    let fault = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::AlreadyExists => Error::Exists { path: path.clone() },
        _ => Error::Write { path: path.clone(), source },
    };
    let mut file = temporary(path).map_err(fault)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(fault)?;
    file.persist_noclobber(path).map_err(|e| fault(e.error))?;
    Ok(())
}

/// An empty file in the folder of `path`, with the permissions of the file that it will replace or of any new one.
fn temporary(path: &PathBuf) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".penvis-");
    let kept = fs::metadata(path).ok().map(|there| there.permissions());
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The process's mask applies to these.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder(path))?;
    if let Some(permissions) = kept {
        file.as_file().set_permissions(permissions)?;
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_files_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a"), folder.path().join("none/b"));
        let files = [(a.clone(), b"1".to_vec()), (b, b"2".to_vec())];
        assert!(write_all(&files).unwrap_err().to_string().contains("none/b"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        write_all(&files[..1]).unwrap();
        write_all(&[(a.clone(), b"3".to_vec())]).unwrap();
        assert_eq!(fs::read(a).unwrap(), b"3");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_new_file_replaces_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        write_new(&path, b"1").unwrap();
        assert!(write_new(&path, b"2").unwrap_err().to_string().contains("is there already"));
        assert_eq!(fs::read(&path).unwrap(), b"1");
        assert!(matches!(write_new(&folder.path().join("none/a"), b"1"), Err(Error::Write { .. })));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_any_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let mode = || fs::metadata(&path).unwrap().permissions().mode() & 0o777;
        fs::write(folder.path().join("b"), "").unwrap();
        let usual = fs::metadata(folder.path().join("b")).unwrap().permissions().mode() & 0o777;
        write_all(&[(path.clone(), Vec::new())]).unwrap();
        assert_eq!(mode(), usual);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        write_all(&[(path.clone(), Vec::new())]).unwrap();
        assert_eq!(mode(), 0o640);
    }
}
