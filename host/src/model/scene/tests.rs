//! Scenes from text and from files.

use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3};
use penvis_core::scene::SceneSurface;
use penvis_core::stroke::CurveKind;
use proptest::prelude::*;

use super::*;
use crate::fill::FillKind;
use crate::model::{Model, Projection, load};
use crate::page::{Hidden, KindPens, Placing, Position, Size};
use crate::pens::Pen;

fn read_text(text: &str) -> Result<Import, ReadError> {
    let mut source = Source::from_bytes("thing", text.as_bytes().to_vec())?;
    read(&mut source, &Reading::new(&()))
}

fn import(text: &str) -> Import {
    read_text(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn message(text: &str) -> String {
    match read_text(text) {
        Ok(_) => panic!("{text} was read"),
        Err(error) => error.to_string(),
    }
}

fn loaded(path: &Path) -> Result<Model, String> {
    let spec = path.to_str().unwrap().to_owned();
    load(std::slice::from_ref(&spec), &Reading::new(&())).map_err(|error| error.to_string().replace(&spec, "FILE"))
}

/// Lower and upper corner of the box of some surfaces, by points on them.
fn extent<'a>(surfaces: impl IntoIterator<Item = &'a SceneSurface>) -> [DVec3; 2] {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for part in surfaces {
        let (u, v) = (part.surface.domain_u(), part.surface.domain_v());
        for k in 0..17 * 17 {
            let at = |[a, b]: [f64; 2], k: i32| a + (b - a) * f64::from(k) / 16.0;
            let p = part.surface.eval(at(u, k % 17), at(v, k / 17));
            (low, high) = (low.min(p), high.max(p));
        }
    }
    [low, high]
}

/// Volume inside closed surfaces by the divergence theorem over small quadrilaterals: positive if positive sides are outside.
fn volume(surfaces: &[SceneSurface]) -> f64 {
    const N: i32 = 64;
    let mut sum = 0.0;
    for part in surfaces {
        let (u, v) = (part.surface.domain_u(), part.surface.domain_v());
        let at = |[a, b]: [f64; 2], k: i32| a + (b - a) * f64::from(k) / f64::from(N);
        for k in 0..N * N {
            let corner = |i: i32, j: i32| part.surface.eval(at(u, k % N + i), at(v, k / N + j));
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            sum += a.dot(b.cross(c)) + a.dot(c.cross(d));
        }
    }
    sum / 6.0
}

#[test]
fn shapes_have_their_measures_and_face_outwards() {
    use std::f64::consts::PI;
    let table = [
        ("box = { size = [2, 4, 3] }", 6, [-1.0, -2.0, 0.0], [1.0, 2.0, 3.0], 24.0),
        ("sphere = { radius = 2 }", 1, [-2.0; 3], [2.0; 3], 32.0 / 3.0 * PI),
        ("cylinder = { radius = 1, height = 3 }", 3, [-1.0, -1.0, 0.0], [1.0, 1.0, 3.0], 3.0 * PI),
        ("cone = { radius = 2, height = 3 }", 2, [-2.0, -2.0, 0.0], [2.0, 2.0, 3.0], 4.0 * PI),
        ("cone = { radius = 0, top_radius = 2, height = 3 }", 2, [-2.0, -2.0, 0.0], [2.0, 2.0, 3.0], 4.0 * PI),
        ("cone = { radius = 2, top_radius = 1, height = 3 }", 3, [-2.0, -2.0, 0.0], [2.0, 2.0, 3.0], 7.0 * PI),
        ("torus = { radius = 3, tube_radius = 1 }", 1, [-4.0, -4.0, -1.0], [4.0, 4.0, 1.0], 6.0 * PI * PI),
        ("rectangle = { size = [3, 1] }", 1, [-1.5, -0.5, 0.0], [1.5, 0.5, 0.0], 0.0),
        ("disk = { radius = 2 }", 1, [-2.0, -2.0, 0.0], [2.0, 2.0, 0.0], 0.0),
    ];
    for (shape, count, low, high, content) in table {
        // Mirrored ones are the same solids, and outwards is still outwards.
        for (placement, factor) in [("", 1.0), ("scale = [-1, 1, 1]", 1.0), ("scale = -2\nrotate = [90, 0, 180]", 8.0)]
        {
            let found = import(&format!("[[object]]\n{shape}\n{placement}\n"));
            let surfaces = &found.scene.surfaces;
            assert_eq!(surfaces.len(), count, "{shape}");
            let inside = volume(surfaces);
            assert!(
                (inside - factor * content).abs() <= 0.01 * factor * content + 1e-12,
                "{shape} {placement}: {inside}"
            );
            if factor == 1.0 {
                let [a, b] = extent(surfaces);
                assert!(a.abs_diff_eq(low.into(), 1e-12) && b.abs_diff_eq(high.into(), 1e-12), "{shape}: {a} {b}");
            }
        }
    }
    let up = import("[[object]]\ndisk = { radius = 2 }\n[[object]]\nrectangle = { size = [1, 1] }");
    for part in &up.scene.surfaces {
        let (_, du, dv) = part.surface.derivatives(0.4, 0.3);
        assert!(du.cross(dv).z > 0.0, "{}", part.name);
    }
}

#[test]
fn an_object_is_scaled_then_turned_then_moved_then_repeated() {
    let corner = |keys: &str| {
        // The corner (1, 2, 3) of a box is the farthest along (1, 1, 1).
        let found = import(&format!("[[object]]\nbox = {{ size = [2, 4, 3] }}\n{keys}"));
        let points = found.scene.surfaces[1].surface.homogeneous().to_vec();
        points
            .iter()
            .map(|h| h.truncate())
            .find(|p| found.scene.surfaces[5].surface.homogeneous().iter().any(|q| q.truncate() == *p))
    };
    // Right and top have the two corners (1, ±2, 3) in common; the first in the order of the net is the one behind.
    assert_eq!(corner(""), Some(DVec3::new(1.0, -2.0, 3.0)));
    assert_eq!(corner("scale = [2, 3, 4]"), Some(DVec3::new(2.0, -6.0, 12.0)));
    // Quarter turns are exact.
    assert_eq!(corner("rotate = { axis = [0, 0, 7], degrees = 90 }"), Some(DVec3::new(2.0, 1.0, 3.0)));
    assert_eq!(corner("rotate = { axis = [0, 0, 7], degrees = -630 }"), Some(DVec3::new(2.0, 1.0, 3.0)));
    assert_eq!(corner("rotate = [90, 0, 0]"), Some(DVec3::new(1.0, -3.0, -2.0)));
    // About x first: (1, -2, 3), (1, -3, -2), about z then: (3, 1, -2).
    assert_eq!(corner("rotate = [90, 0, 90]"), Some(DVec3::new(3.0, 1.0, -2.0)));
    assert_eq!(corner("rotate = [0, 90, 0]"), Some(DVec3::new(3.0, -2.0, -1.0)));
    let all = "translate = [10, 0, 0]\nrotate = { axis = [0, 0, 1], degrees = 90 }\nscale = [2, 1, 1]";
    assert_eq!(corner(all), Some(DVec3::new(12.0, 2.0, 3.0)));
    let third = corner("rotate = { axis = [1, 1, 1], degrees = 120 }").unwrap();
    assert!(third.abs_diff_eq(DVec3::new(3.0, 1.0, -2.0), 1e-14), "{third}");

    let row = import(
        "[[object]]\nname = 'ball'\nsphere = { radius = 1 }\nscale = 2\ntranslate = [0, 0, 5]
array = [{ count = 3, step = [10, 0, 0] }, { count = 2, step = [0, 20, 0] }]",
    );
    let middles = row.scene.surfaces.iter().map(|s| extent([s]).map(|p| p / 2.0)).map(|[low, high]| low + high);
    let middles: Vec<_> = middles.map(|p| p.round().to_array()).collect();
    let expected = [0.0, 20.0].map(|y| [0.0, 10.0, 20.0].map(|x| [x, y, 5.0]));
    assert_eq!(middles, expected.concat());
    assert_eq!([0, 5].map(|k| row.scene.surfaces[k].name.as_str()), ["ball 1/sphere", "ball 6/sphere"]);
}

#[test]
fn styles_are_the_objects_own_or_those_of_all() {
    let found = import(
        "name = 'still life'
[style]
pen = 3
iso = 4
[[object]]
model = 'linked_tori'
pen = 2
hidden = 'layer'
[[object]]
disk = { radius = 1 }
curves = ['boundary', 'intersection']
[[object]]
disk = { radius = 2 }
curves = 'silhouette, iso'
[page]
paper = '200x100mm'
margin = 5
tolerance = 0.5
[camera]
view = 'front'
perspective = 30
",
    );
    assert_eq!((found.scene.name.as_str(), found.scene.surfaces.len()), ("still life", 4));
    let ranges: Vec<_> = found.styles.iter().map(|(range, _)| range.clone()).collect();
    assert_eq!(ranges, [0..2, 2..3, 3..4]);
    let [tori, disk, other] = [0, 1, 2].map(|k| found.styles[k].1);
    assert_eq!(
        (tori.pens, tori.isos, tori.hidden, tori.curves),
        (KindPens::all(2), Some(4), Some(Hidden::Layer), None)
    );
    assert_eq!((disk.pens, disk.isos, disk.hidden), (KindPens::all(3), Some(4), None));
    assert_eq!(disk.curves, crate::style::kinds(["intersection", "boundary"]).ok());
    assert_eq!(other.curves, crate::style::kinds(["silhouette", "iso"]).ok());
    let (page, margin) = found.sheet.settle().unwrap();
    assert_eq!((page.width_mm, page.height_mm, margin, found.sheet.settled_tolerance_mm()), (200.0, 100.0, 5.0, 0.5));
    assert_eq!(found.view, None);
    let Projection::Perspective { eye, target } = found.aim.resolve(None, &found.scene).projection else {
        panic!("{:?}", found.aim)
    };
    assert!(eye.y < target.y && (eye - target).x.abs() < 1e-9);
    assert_eq!(
        found.report.kinds.iter().map(|(k, n)| (k.as_str(), *n)).collect::<Vec<_>>(),
        [("plane", 2), ("surface of linked_tori", 2)]
    );
}

#[test]
fn a_camera_stands_at_a_point_or_looks_in_a_direction() {
    let object = "[[object]]\ndisk = { radius = 1 }\n";
    let eye = import(&format!("{object}[camera]\neye = [1, -9, 4]\ntarget = [0, 0, 1]\nup = [0.1, 0, 1]"));
    let expected = Projection::Perspective { eye: DVec3::new(1.0, -9.0, 4.0), target: DVec3::Z };
    assert_eq!(eye.view.map(|v| (v.projection, v.up)), Some((expected, DVec3::new(0.1, 0.0, 1.0))));
    let above = import(&format!("{object}[camera]\nview = [0, 0, 2]"));
    assert_eq!(above.aim.resolve(above.view, &above.scene).up, DVec3::Y);
    for (camera, expected) in [
        ("eye = [1, 2, 3]", "line 3: [camera] needs the key `target`"),
        ("target = [1, 2, 3]", "line 4: `target` goes with `eye`"),
        ("eye = [1, 2, 3]\ntarget = [0, 0, 0]\nview = 'top'", "line 6: `view` does not go with `eye`"),
        ("eye = [1, 2, 3]\ntarget = [1, 2, 3]", "line 3: "),
        ("view = 'top'\nup = [0, 0, 1]", "line 3: the up vector is parallel"),
        ("view = 'above'", "line 4: `view` is neither a direction [x, y, z] nor one of front, "),
        ("view = [0, 0, 0]", "line 4: `view` has no direction"),
        ("view = [0, 0, inf]", "line 4: `view` is inf; give a finite number"),
        ("perspective = 180", "line 4: `perspective` is 180; give an angle between"),
    ] {
        let found = message(&format!("{object}[camera]\n{camera}"));
        assert!(found.starts_with(expected), "{camera}: {found}");
    }
}

#[test]
fn pens_are_described_and_told_apart_by_what_they_draw() {
    let text = "[style]\npen = 4\n[[pen]]\nnumber = 2\nwidth = 0.5\ncolor = '#c82828'\n[[pen]]\nnumber = 3\ncolor = 'navy'\nspeed = 20\n\
                force = 3\n[[object]]\ndisk = { radius = 1 }\npen = { silhouette = 2, iso = 3, hidden = 6 }";
    let found = import(text);
    let red = Pen { width_mm: Some(0.5), color: Some([200, 40, 40]), ..Pen::default() };
    let navy = Pen { color: Some([0, 0, 128]), speed_mm_s: Some(20.0), force: Some(3), ..Pen::default() };
    assert_eq!(found.pens, BTreeMap::from([(2, red), (3, navy)]));
    let pens = found.styles[0].1.pens;
    assert_eq!([CurveKind::Silhouette, CurveKind::Iso, CurveKind::Boundary].map(|kind| pens.of(kind)), [2, 3, 4]);
    assert_eq!(pens.of_hidden(), Some(6));
    let object = "[[object]]\ndisk = { radius = 1 }\n";
    for (rest, expected) in [
        ("pen = { isos = 2 }", "line 3: there is no key `isos` in `pen`; the nearest one is `iso`"),
        ("pen = { iso = 0 }", "line 3: `iso` is 0; give a whole number from 1 to 99"),
        ("pen = 'red'", "line 3: `pen` is the text \"red\"; give a whole number"),
        ("[[pen]]\nwidth = 1", "line 3: a pen needs the key `number`"),
        ("[[pen]]\nnumber = 1\n[[pen]]\nnumber = 1", "line 6: `number` is 1 again"),
        ("[[pen]]\nnumber = 1\nwidth = 0", "line 5: `width` is 0; give a width in mm"),
        ("[[pen]]\nnumber = 1\ncolor = 'reddish'", "line 5: `color` is no colour"),
        ("[[pen]]\nnumber = 1\nspeed = nan", "line 5: `speed` is nan; give a speed in mm/s"),
    ] {
        let found = message(&format!("{object}{rest}"));
        assert!(found.starts_with(expected), "{rest}: {found}");
    }
}

#[test]
fn the_picture_has_a_size_and_a_place_on_the_page() {
    let object = "[[object]]\ndisk = { radius = 1 }\n";
    let placing = |page: &str| import(&format!("{object}[page]\n{page}")).sheet.placing();
    assert_eq!(placing(""), Placing::default());
    let at = Position::At(DVec2::new(20.0, 35.0));
    let whole = Placing { size: Size::Scale(0.5), position: at, clip: true };
    assert_eq!(placing("scale = '1:2'\nposition = '20mm, 3.5cm'\nclip = true"), whole);
    for (page, size) in [
        ("scale = 2", Size::Scale(2.0)),
        ("width = 120", Size::Width(120.0)),
        ("width = '12cm'", Size::Width(120.0)),
        ("height = '2in'", Size::Height(50.8)),
    ] {
        assert_eq!(placing(page).size, size, "{page}");
    }
    for (page, expected) in [
        ("scale = 0", "line 4: `scale` is 0; give a ratio"),
        ("scale = '1:0'", "line 4: `scale` is no ratio"),
        ("width = -1", "line 4: `width` is -1; give a length more than 0"),
        ("width = '5ft'", "line 4: `width` is not a length more than 0"),
        ("width = 5\nheight = 5", "line 5: `height` is one size too many"),
        ("position = 'left'", "line 4: `position` is neither"),
        ("clip = 1", "line 4: `clip` is 1; give true or false"),
    ] {
        let found = message(&format!("{object}[page]\n{page}"));
        assert!(found.starts_with(expected), "{page}: {found}");
    }
}

#[test]
fn scenes_are_parts_of_scenes_with_their_styles_and_their_files() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    };
    write("parts/roof.obj", "v 0 0 0\nv 2 0 0\nv 1 1 0.1\nv 2 2 0\nf 1 2 3\nf 3 2 4\n");
    write(
        "parts/pair.toml",
        "[style]\npen = 2\niso = 5\ncrease_angle = 70\n[[object]]\nname = 'roof'\nmodel = 'roof.obj'\n[[object]]\nsphere = { radius = 1 }\npen = 7\niso = 3",
    );
    let all = write(
        "all.toml",
        "[style]\npen = 9\ncurves = 'iso'\n[[object]]\nmodel = 'sphere'\n[[object]]\nmodel = 'parts/pair.toml'\niso = 1\nscale = 2
array = { count = 2, step = [9, 0, 0] }\n[[object]]\nmodel = 'parts/roof.obj'\nname = 'x'",
    );
    let model = loaded(&all).unwrap();
    assert_eq!(model.scene.name, "all");
    let names: Vec<_> = model.scene.surfaces.iter().map(|s| s.name.as_str()).collect();
    assert_eq!((names.len(), names[1], names[8].starts_with("x/")), (9, "roof/surface 0", true), "{names:?}");
    // The object goes before the inner scene, the inner scene before what the outer one says of all.
    let pens: Vec<_> = model.choices().iter().map(|c| (c.pens.only().unwrap(), c.isos)).collect();
    let pair = [(2, Some(1)), (2, Some(1)), (7, Some(1))];
    assert_eq!(pens, [&[(9, None)][..], &pair, &pair, &[(9, None), (9, None)]].concat());
    assert!(model.choices().iter().all(|c| c.curves == crate::style::kinds(["iso"]).ok()));
    let files: Vec<_> = model.files.iter().map(|f| (f.format, f.surfaces.clone())).collect();
    assert_eq!(files, [("scene", 0..9), ("scene", 1..4), ("OBJ", 1..3), ("OBJ", 7..9)]);
    let angle = |k: usize| model.scene.surfaces[k].facet.unwrap().crease_angle.to_degrees().round();
    assert_eq!([1, 7].map(angle), [70.0, 30.0]);
    // The inner one has only the second roof's worth of size.
    let [low, high] = extent(&model.scene.surfaces[4..6]);
    assert!(low.abs_diff_eq(DVec3::new(9.0, 0.0, 0.0), 1e-9) && high.abs_diff_eq(DVec3::new(13.0, 4.0, 0.2), 1e-9));

    let circle = write("a.toml", "\n[[object]]\nmodel = 'b.toml'");
    write("b.toml", "[[object]]\nmodel = './a.toml'");
    let found = loaded(&circle).unwrap_err();
    assert!(
        found.starts_with("FILE: line 3: ") && found.contains("b.toml: line 2: ") && found.contains("refers to itself"),
        "{found}"
    );
    for k in 0..20 {
        write(&format!("d{k}.toml"), &format!("[[object]]\nmodel = 'd{}.toml'", k + 1));
    }
    write("d20.toml", "[[object]]\nmodel = 'sphere'");
    assert!(loaded(&folder.path().join("d5.toml")).is_ok());
    let found = loaded(&folder.path().join("d0.toml")).unwrap_err();
    assert!(found.starts_with("FILE: line 2: "), "{found}");
    let gone = write("gone.toml", "[[object]]\nmodel = 'gone.obj'");
    let found = loaded(&gone).unwrap_err();
    assert!(found.starts_with("FILE: line 2: there is no file `") && found.contains("gone.obj"), "{found}");
}

#[test]
fn what_is_too_much_is_refused_before_it_is_made() {
    let doubled = "[[object]]\nbox = { size = [1, 1, 1] }\narray = [{ count = 1000000, step = [1, 0, 0] }, { count = 1000000, step = [0, 1, 0] }, { count = 1000000, step = [0, 0, 1] }]";
    let found = message(doubled);
    assert!(found.starts_with("line 2: with 1000000000000000000 of this the scene has "), "{found}");
    assert!(
        message("[[object]]\nmodel = 'teapot'\narray = { count = 40000, step = [1, 0, 0] }").contains("take fewer")
    );
    for (before, each, after) in [("", "a.", "a = 1"), ("[", "a.", "a]"), ("a = ", "{ a = ", ""), ("a = ", "[", "")] {
        let deep = format!("{before}{}{after}", each.repeat(150_000));
        assert!(message(&deep).contains("recur"), "{}", message(&deep));
    }
    assert!(message(&"#".repeat(1 << 21)).contains("larger than 1 MiB"));
}

#[test]
fn contents_tell_a_scene_from_other_files() {
    let is = |text: &str| looks_like(text.as_bytes());
    assert!(is("# [[x]]\n\n  [[object]]\nmodel = 'a'") && is("[[object]]"));
    assert!(!is("solid [[object]]\n") && !is("name = 'plotter'\n"));
}

const GOOD: &str = "name = \"all of it\"\n[camera]\nview = [1, -2, 0.8]\nup = [0, 0, 1]\nperspective = 30\n[page]\npaper = \"a4\"\n\
orientation = \"portrait\"\nmargin = 15\ntolerance = 0.01\nscale = \"1:2\"\nposition = \"20mm,30mm\"\nclip = true\n[[pen]]\nnumber = 2\nwidth = 0.5\ncolor = \"navy\"\nspeed = 20\nforce = 3\n[style]\npen = { iso = 2, hidden = 3 }\ncurves = [\"iso\"]\niso = 2\nhidden = \"dashed\"\n\
crease_angle = 30\n[[object]]\nname = \"a\"\nmodel = \"saddle\"\nscale = [1, -2, 3]\nrotate = [1, 2, 3]\ntranslate = [1, 2, 3]\n\
array = { count = 2, step = [1, 0, 0] }\n[[object]]\ncone = { radius = 1, top_radius = 0.5, height = 2 }\n\
rotate = { axis = [1, 1, 0], degrees = 30 }\n";

#[test]
fn every_key_is_read() {
    let found = import(GOOD);
    assert_eq!((found.scene.surfaces.len(), found.styles.len()), (5, 1));
    // All copies count.
    let kinds: Vec<_> = found.report.kinds.iter().map(|(kind, number)| (kind.as_str(), *number)).collect();
    assert_eq!(kinds, [("cone", 1), ("plane", 2), ("surface of saddle", 2)]);
}

proptest! {
    #[test]
    fn changed_bytes_never_panic(
        at in any::<prop::sample::Index>(), len in 0_usize..20, with in prop::collection::vec(any::<u8>(), 0..12)
    ) {
        let mut bytes = GOOD.as_bytes().to_vec();
        let at = at.index(bytes.len());
        let end = (at + len).min(bytes.len());
        bytes.splice(at..end, with);
        let mut source = Source::from_bytes("thing", bytes).unwrap();
        let _ = read(&mut source, &Reading::new(&()));
    }

    #[test]
    fn changed_words_never_panic(at in any::<prop::sample::Index>(), word in "[0-9a-z_\\-\\.\\[\\]{}\"',= ]{0,8}") {
        let mut lines: Vec<String> = GOOD.lines().map(str::to_owned).collect();
        let at = at.index(lines.len());
        let key = lines[at].split('=').next().unwrap().to_owned();
        lines[at] = format!("{key}= {word}");
        let mut source = Source::from_bytes("thing", lines.join("\n").into_bytes()).unwrap();
        let _ = read(&mut source, &Reading::new(&()));
    }
}

#[test]
fn surfaces_are_drawn_otherwise_than_their_object_by_name() {
    let text = "
[[object]]
box = { size = [1, 1, 1] }
array = { count = 2, step = [3, 0, 0] }
fill = { kind = 'hatch', pitch = 2 }
pen = 4
surface.top = { fill = { angle = 30, gap = 0 }, pen = { hatch = 7 }, curves = ['iso'] }

[object.surface.left]
fill = 'none'
hidden = 'layer'

[style]
fill = { kind = 'cross', pitch = 9, gap = 1 }
";
    let model = Model { styles: import(text).styles, scene: import(text).scene, ..Model::default() };
    let choices = model.choices();
    assert_eq!(choices.len(), 12);
    for (surface, choice) in model.scene.surfaces.iter().zip(&choices) {
        let fill = choice.fill;
        let found = (fill.kind, fill.degrees, fill.pitch_mm, fill.gap_mm);
        let hatch = Some(Some(FillKind::Hatch));
        match surface.name.as_str() {
            "top" => {
                assert_eq!(found, (hatch, Some(30.0), Some(2.0), Some(0.0)));
                assert_eq!((choice.pens.of(CurveKind::Hatch), choice.pens.of(CurveKind::Crease)), (7, 4));
                assert!(choice.curves.is_some_and(|curves| curves.iso && !curves.crease));
            }
            "left" => {
                assert_eq!((fill.kind, choice.hidden), (Some(None), Some(Hidden::Layer)));
                assert_eq!(choice.pens.of(CurveKind::Hatch), 4);
            }
            _ => assert_eq!((found, choice.hidden), ((hatch, None, Some(2.0), Some(1.0)), None), "{}", surface.name),
        }
    }
}

#[test]
fn a_surface_that_there_is_not_is_told_with_its_line_and_the_nearest_one() {
    let all = |keys: &str| format!("[[object]]\nbox = {{ size = [1, 1, 1] }}\n{keys}");
    let told = message(&all("surface.tpo = { fill = 'hatch' }"));
    assert!(
        told.starts_with("line 3: `surface`: the object has no surface `tpo`; the nearest name is `top`, and all are "),
        "{told}"
    );
    for name in ["top", "bottom", "left", "right", "front", "back"] {
        assert!(told.contains(name), "{told}");
    }
    let told = message(&all("surface = { top = { fill = 'hatch' },  bottom = { fil = 'hatch' } }"));
    assert!(told.starts_with("line 3: there is no key `fil` in a surface; the nearest one is `fill`, and all are pen, curves, iso, hidden, fill"), "{told}");
    let told = message(&all("surface = 'top'"));
    assert!(
        told.starts_with("line 3: `surface` is the text \"top\"; give a table of surfaces by their names"),
        "{told}"
    );
    let told = message(&all("surface.top = 'hatch'"));
    assert!(
        told.starts_with("line 3: `top` is the text \"hatch\"; give a table of pen, curves, iso, hidden, fill"),
        "{told}"
    );
    let told = message(&all("surface.top.crease_angle = 3"));
    assert!(told.contains("no key `crease_angle` in a surface"), "{told}");
    // Of a great many only the first are told.
    let many = "[[object]]\nmodel = 'spring'\nsurface.coil = { pen = 2 }";
    let told = message(many);
    assert!(told.contains(" more") && told.len() < 1000, "{told}");
}
