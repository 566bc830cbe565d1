//! Scenes packed for boards: what they draw is what the program draws, to the bit, however little memory there is.

use penvis::builtin;
use penvis::compute::load;
use penvis::progress::Progress;
use penvis::store::store;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_firmware::scene::{StoredScene, draw};
use penvis_tests::plotter::{options, simulated};

/// The packed scene of what `penvis draw` with these words draws.
fn packed(words: &[&str]) -> Vec<u8> {
    let (options, progress) = (options(words), Progress::start());
    let loaded = load(&options, &progress).expect("the model can be read");
    store(loaded, &simulated()).expect("a board could draw it").pack().expect("it can be packed")
}

/// FNV-1a over the coordinates on the screen, beside the firmware's own.
fn hash(points: impl Iterator<Item = [f64; 2]>) -> u64 {
    let bytes = points.flatten().flat_map(f64::to_le_bytes);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn packed_models_are_drawn_to_the_bit_as_the_models_are() {
    for (name, _) in builtin::names() {
        let bytes = packed(&[name]);
        let stored = StoredScene::unpack(&bytes).expect("it was packed");
        let model = builtin::load(name).expect("a built-in model");
        assert_eq!(stored.scene.surfaces, model.scene.surfaces, "{name}");
        let camera = model.view.camera().expect("a camera");
        let prepared = Prepared::new(&model.scene, &camera, &DrawOptions::default(), &()).expect("a picture");
        let strokes = prepared.trace(stored.tolerance, &()).expect("nothing stops it").strokes;
        let expected = hash(strokes.iter().flat_map(|s| &s.points).map(|p| p.screen.to_array()));
        for cells in [0, 500] {
            let figures = draw(&bytes, cells, &(), &mut |_| true).expect("it can be drawn");
            println!("{name}, {cells} cells: {figures:x?}, {} bytes", bytes.len());
            assert_eq!(figures.strokes as usize, strokes.len(), "{name}, {cells} cells");
            assert_eq!(figures.hash, expected, "{name}, {cells} cells");
        }
    }
}

#[test]
fn sections_and_hidden_curves_survive_packing() {
    for words in [&["linked_tori", "--hidden", "layer"][..], &["teapot", "--curves", "crease,intersection"]] {
        let bytes = packed(words);
        let once = draw(&bytes, 0, &(), &mut |_| true).expect("it can be drawn");
        let stored = StoredScene::unpack(&bytes).expect("it was packed");
        let again = draw(&stored.pack().expect("it was packed before"), usize::MAX, &(), &mut |_| true);
        assert_eq!(again.expect("it can be drawn"), once, "{words:?}");
        assert!(once.strokes > 5, "{words:?}: {once:?}");
    }
}
