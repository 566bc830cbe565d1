use super::*;
use crate::device;
use crate::drawing::{DrawingFormat, file};

fn read_at(xml: &str, tolerance_mm: f64) -> Result<Found, String> {
    file::tests::read(DrawingFormat::Svg, xml, device::DEFAULT, tolerance_mm)
}

/// What is within an SVG of 100 × 50 mm whose units are millimetres.
fn within(attributes: &str, inner: &str) -> Result<Found, String> {
    read_at(
        &format!(
            "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink' \
             xmlns:inkscape='http://www.inkscape.org/namespaces/inkscape' \
             width='100mm' height='50mm' viewBox='0 0 100 50' stroke='black' {attributes}>\n{inner}\n</svg>"
        ),
        0.01,
    )
}

/// The strokes, rounded to a nanometre: layer, pen, points.
fn strokes(found: &Found) -> Vec<(&str, u32, Vec<[f64; 2]>)> {
    let rounded = |p: &DVec2| (*p * 1e6).round().to_array().map(|x| x / 1e6);
    found.drawing.polylines.iter().map(|p| (p.layer.as_str(), p.pen, p.page.iter().map(rounded).collect())).collect()
}

/// The first stroke's points.
fn first(inner: &str) -> Vec<[f64; 2]> {
    strokes(&within("", inner).unwrap()).remove(0).2
}

#[test]
fn lines_lie_where_the_file_says_in_millimetres_and_y_upwards() {
    let found = within("", "<path d='M10 10H30V20'/>").unwrap();
    assert_eq!(found.drawing.page.width_mm.round(), 100.0);
    assert_eq!(strokes(&found), [("ink", 1, vec![[10.0, 40.0], [30.0, 40.0], [30.0, 30.0]])]);
    assert_eq!((found.drawing.name.as_str(), found.notes.len()), ("fed", 0));
    assert_eq!(within("", "<title> two\nwords </title>").unwrap().drawing.name, "two words");
    // A pixel is 1/96 inch.
    let px =
        read_at("<svg xmlns='http://www.w3.org/2000/svg' width='960' height='96'><path d='M0 96H960'/></svg>", 0.01);
    assert_eq!(strokes(&px.unwrap())[0].2, [[0.0, 0.0], [254.0, 0.0]]);
}

#[test]
fn transforms_and_uses_and_inner_pictures_add_up() {
    let table: &[(&str, &[[f64; 2]])] = &[
        (
            "<g transform='translate(10,5)'><g transform='scale(2)'><path d='M0 0H5'/></g></g>",
            &[[10.0, 45.0], [20.0, 45.0]],
        ),
        ("<path transform='rotate(90 10 10)' d='M10 10H20'/>", &[[10.0, 40.0], [10.0, 30.0]]),
        ("<defs><path id='p' d='M0 0H5'/></defs><use href='#p' x='10' y='10'/>", &[[10.0, 40.0], [15.0, 40.0]]),
        (
            "<defs><g id='p'><path d='M0 0H5'/></g></defs><use xlink:href='#p' transform='scale(2)' x='10'/>",
            &[[20.0, 50.0], [30.0, 50.0]],
        ),
        (
            "<symbol id='s' viewBox='0 0 10 10'><path d='M0 0H10'/></symbol><use href='#s' x='5' width='20' height='20'/>",
            &[[5.0, 50.0], [25.0, 50.0]],
        ),
        (
            "<svg x='10' y='10' width='20' height='40' viewBox='0 0 1 1'><path d='M0 0H1'/></svg>",
            &[[10.0, 30.0], [30.0, 30.0]],
        ),
        (
            "<switch><path requiredExtensions='x' d='M0 0H1'/><path systemLanguage='de,en-GB' d='M0 0H2'/><path d='M0 0H3'/></switch>",
            &[[0.0, 50.0], [2.0, 50.0]],
        ),
        ("<a><line x2='50%'/></a>", &[[0.0, 50.0], [50.0, 50.0]]),
    ];
    for (inner, expected) in table {
        assert_eq!(first(inner), *expected, "{inner}");
    }
}

#[test]
fn layers_are_those_of_inkscape_or_groups_at_the_top_or_colours() {
    let layers = |inner: &str| -> Vec<(String, u32)> {
        let found = within("", inner).unwrap();
        strokes(&found).iter().map(|(layer, pen, _)| ((*layer).to_owned(), *pen)).collect()
    };
    let line = "<path d='M0 0H1'/>";
    let named = |names: &[(&str, u32)]| names.iter().map(|(name, pen)| ((*name).to_owned(), *pen)).collect::<Vec<_>>();
    let layer =
        |label: &str, inner: &str| format!("<g inkscape:groupmode='layer' id='i' inkscape:label='{label}'>{inner}</g>");
    let inner = layer("sub", line);
    let text =
        [layer("b &amp; c", line), layer("d", &format!("{line}{inner}<g id='no'>{line}</g>")), line.into()].concat();
    assert_eq!(layers(&text), named(&[("b & c", 1), ("d", 2), ("sub", 3), ("d", 2), ("ink", 4)]));
    let text = format!("<g id='a'>{line}<g id='inner'>{line}</g></g><g>{line}</g><g id='b'>{line}</g>");
    assert_eq!(layers(&text), named(&[("a", 1), ("a", 1), ("ink", 2), ("b", 3)]));
    // What is drawn again is drawn where the use is.
    let text = format!("<g id='a'><use href='#b'/></g><g id='b'>{line}</g>");
    assert_eq!(layers(&text), named(&[("a", 1), ("b", 2)]));
    let text = "<path d='M0 0H1'/><path d='M0 0H1' stroke='#C00'/><path d='M0 0H2'/>";
    assert_eq!(layers(text), named(&[("#000000", 1), ("#cc0000", 2), ("#000000", 1)]));
}

#[test]
fn what_shows_is_drawn_in_its_colour() {
    let found = within(
        "",
        "<style>.thick { stroke: teal } .off { display: none }</style>\
         <g id='a'><path class='thick' d='M0 0H1'/><path class='off' d='M0 0H1'/></g>\
         <g id='b' stroke='none'><path d='M0 0H1'/><path fill='none' d='M0 0H1'/></g><g id='c' stroke='red'><circle r='9'/></g>",
    );
    let found = found.unwrap();
    assert_eq!(strokes(&found).iter().map(|s| s.0).collect::<Vec<_>>(), ["a", "b", "c"]);
    assert_eq!(found.colours, BTreeMap::from([(1, [0, 128, 128]), (2, [0; 3]), (3, [255, 0, 0])]));
}

#[test]
fn curves_are_within_the_tolerance_on_the_paper() {
    let circle = "<g transform='scale(4)'><circle cx='10' cy='6' r='5'/></g>";
    let text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='100mm' height='50mm' viewBox='0 0 100 50'>{circle}</svg>"
    );
    for tolerance in [0.001, 0.5] {
        let found = read_at(&text, tolerance).unwrap();
        let line = &found.drawing.polylines[0].page;
        assert_eq!(line.first(), line.last());
        let centre = DVec2::new(40.0, 26.0);
        for w in line.windows(2) {
            assert!((w[0].distance(centre) - 20.0).abs() < 1e-9);
            let sagitta = 20.0 - ((w[0] + w[1]) / 2.0).distance(centre);
            assert!(sagitta > 0.3 * tolerance && sagitta <= tolerance, "{sagitta}");
        }
    }
}

#[test]
fn what_a_pen_cannot_draw_is_counted() {
    let found = within(
        "",
        "<text>a</text><text>b</text><image href='x.png'/>\n<path clip-path='url(#c)' marker-end='url(#m)' d='M0 0H1L'/><use href='#gone'/>\
         <defs><text>no</text></defs>",
    );
    let found = found.unwrap();
    assert_eq!(found.drawing.polylines.len(), 1);
    assert_eq!(found.notes.len(), 6, "{:?}", found.notes);
    let has = |text: &str| assert!(found.notes.iter().any(|note| note.starts_with(text)), "{text}: {:?}", found.notes);
    has("2 × text is not drawn; turn it into paths first (the first in line 2)");
    has("1 × an image");
    has("1 × a clip or a mask cuts nothing off; cut the paths themselves (the first in line 3)");
    has("1 × a path with markers");
    has("1 × a use names nothing");
    has("1 × a path is drawn up to where");
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let svg = |attributes: &str| format!("<svg xmlns='http://www.w3.org/2000/svg' {attributes}/>");
    let whole = |text: &str| read_at(text, 0.01).unwrap_err();
    let deep = [vec!["<g>"; 300].concat(), vec!["</g>"; 300].concat()].concat();
    let table = [
        (whole("<svg"), "root node"),
        (whole("{}"), "1:1"),
        (whole("<html/>"), "is no SVG: its first element is not svg"),
        (whole(&svg("")), "says no size; give the svg element width and height, or a viewBox"),
        (whole(&svg("width='0' height='1'")), "svg: is 0.0 × 0.3 mm large, which is no sheet"),
        (whole(&svg("width='99m' height='1in'")), "says a width that is no length, `99m`"),
        (within("", "<path d='M0 0H1e9'/>").unwrap_err(), "line 2, path: has a coordinate of more than 10000 mm"),
        (
            within("", "\n<g id='a' transform='skew(1)'/>").unwrap_err(),
            "line 3, g, #a: has a transform that cannot be read",
        ),
        (within("", &deep).unwrap_err(), "line 2, g: is within 256 others, or in a use of itself"),
        (within("", "<g id='a'><use href='#a'/></g>").unwrap_err(), "or in a use of itself"),
        (within("", "<symbol id='a'><use href='#a'/></symbol><use href='#a'/>").unwrap_err(), "or in a use of itself"),
        (within("", "<circle r='9999'  transform='scale(1e-3 1e300)'/>").unwrap_err(), "line 2, circle: "),
        (
            read_at(&svg("width='9mm' height='9mm'").replace("/>", "><circle r='9'/></svg>"), 1e-18).unwrap_err(),
            "needs more than",
        ),
    ];
    for (message, expected) in table {
        assert!(message.contains(expected) && !message.contains('\n'), "{message:?}, not {expected}");
    }
}

#[test]
fn what_uses_multiply_is_bounded() {
    // Ten each time.
    let mut text = "<g id='u0'><path d='M0 0H1'/></g>".to_owned();
    for k in 1..10 {
        text += &format!("<defs><g id='u{k}'>{}</g></defs>", format!("<use href='#u{}'/>", k - 1).repeat(10));
    }
    let text =
        format!("<svg xmlns='http://www.w3.org/2000/svg' width='9mm' height='9mm'>{text}<use href='#u9'/></svg>");
    let device = device::find("grbl-servo").unwrap();
    let reading = Reading { tolerance_mm: 0.1, gcode: &device, hpgl: &device, stops: &|| false };
    let mut source = Source::from_bytes("fed", text.into_bytes()).unwrap();
    let message = read_most(&mut source, &reading, 1000).unwrap_err().to_string();
    assert!(message.contains("is one of more than 1000 elements"), "{message}");
}

#[test]
fn reading_can_be_stopped() {
    let text =
        format!("<svg xmlns='http://www.w3.org/2000/svg' width='9mm' height='9mm'>{}</svg>", "<g/>".repeat(5000));
    let mut source = Source::from_bytes("fed", text.into_bytes()).unwrap();
    let device = device::find("grbl-servo").unwrap();
    let stopped = read(&mut source, &Reading { tolerance_mm: 0.1, gcode: &device, hpgl: &device, stops: &|| true });
    assert!(matches!(stopped, Err(ReadError::Stopped)));
}
