//! Every saved input of the fuzz targets, fed as the fuzzer does, with what it takes of memory.

use std::fs;
use std::path::{Path, PathBuf};

use peak_alloc::PeakAlloc;
use penvis_tests::feed::{feed, names};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory that a reader may take whatever it is fed: the head of the file, tables, the queues of the firmware.
const ANYWAY: usize = 1 << 20;

/// Bytes of memory for a byte of the input, at the most. A digit and a comma are a knot of eight bytes, in a list that may
/// have room for as many again, and is copied once when it is checked.
const PER_BYTE: usize = 64;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus")
}

/// The saved inputs of a target, in the order of their names.
fn inputs(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = corpus().join(target);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("a file").path()).collect();
    paths.sort();
    paths.into_iter().map(|p| (p.clone(), fs::read(p).expect("a file"))).collect()
}

/// One test, for memory is that of the whole process.
#[test]
fn saved_inputs_do_no_harm() {
    for target in names() {
        let inputs = inputs(&target);
        assert!(inputs.len() >= 4, "{target} has {} inputs", inputs.len());
        for (path, bytes) in inputs {
            println!("{}", path.display());
            MEMORY.reset_peak_usage();
            let before = MEMORY.current_usage();
            feed(&target, &bytes);
            let taken = MEMORY.peak_usage().saturating_sub(before);
            let most = ANYWAY + PER_BYTE * bytes.len();
            assert!(taken <= most, "{}: {taken} bytes of memory for {} bytes", path.display(), bytes.len());
        }
    }
}

#[test]
fn every_reader_has_a_fuzz_target_and_every_target_a_reader() {
    let manifest = fs::read_to_string(corpus().with_file_name("Cargo.toml")).expect("the manifest");
    let named = manifest.lines().filter_map(|l| l.strip_prefix("name = ")).map(|l| l.trim_matches('"').to_owned());
    let mut targets: Vec<String> = named.filter(|n| n != "penvis-fuzz").collect();
    let mut readers = names();
    targets.sort();
    readers.sort();
    assert_eq!(targets, readers);
}
