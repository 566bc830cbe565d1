//! SVG in millimetres, with the layers that Inkscape shows and vpype reads.

use std::fmt::Write as _;

use super::number::decimal;
use crate::drawing::{Drawing, Polyline};

/// Decimals of coordinates in mm.
pub(super) const DECIMALS: usize = 3;

/// The drawing as SVG: user units are mm, one group for each layer and pen in order of first appearance, one path for what is
/// drawn without lifting the pen, round ends, strokes as wide as the pen and of its ink. `command` is what made it, for the metadata.
#[must_use]
pub fn svg(drawing: &Drawing, command: Option<&str>) -> String {
    let (width, height) = (decimal(drawing.page.width_mm, 4), decimal(drawing.page.height_mm, 4));
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n",
        escape(&drawing.name)
    );
    if let Some(command) = command {
        // As Inkscape and vpype keep where a document comes from.
        let _ = writeln!(
            text,
            "<metadata><rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:cc=\"http://creativecommons.org/ns#\" \
             xmlns:dc=\"http://purl.org/dc/elements/1.1/\"><cc:Work rdf:about=\"\"><dc:format>image/svg+xml</dc:format><dc:source>{}</dc:source>\
             </cc:Work></rdf:RDF></metadata>",
            escape(command)
        );
    }
    let groups = groups(drawing);
    for (k, &(layer, pen)) in groups.iter().enumerate() {
        // Layers of one name that are drawn by several pens are told apart by these.
        let is_alone = groups.iter().filter(|(other, _)| *other == layer).count() == 1;
        let label = if is_alone { escape(layer) } else { format!("{} pen {pen}", escape(layer)) };
        let [r, g, b] = drawing.pens.color(pen);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<g inkscape:groupmode=\"layer\" inkscape:label=\"{label}\" id=\"layer{}\" fill=\"none\" \
             stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\"{}\" stroke-linecap=\"round\" stroke-linejoin=\"round\">",
            k + 1,
            decimal(drawing.pens.width_mm(pen), 4)
        );
        let polylines: Vec<&Polyline> = drawing.polylines.iter().filter(|p| p.layer == layer && p.pen == pen).collect();
        for stroke in polylines.chunk_by(|a, b| a.page.last() == b.page.first()) {
            path(&mut text, stroke, drawing.page.height_mm);
        }
        text.push_str("</g>\n");
    }
    text.push_str("</svg>\n");
    text
}

fn groups(drawing: &Drawing) -> Vec<(&str, u32)> {
    let mut groups = Vec::new();
    for polyline in &drawing.polylines {
        let group = (polyline.layer.as_str(), polyline.pen);
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups
}

/// A path along polylines each of which begins where the one before it ends.
fn path(text: &mut String, stroke: &[&Polyline], height_mm: f64) {
    text.push_str("<path d=\"");
    let points = stroke.iter().enumerate().flat_map(|(k, p)| p.page.iter().skip(usize::from(k > 0)));
    for (k, p) in points.enumerate() {
        let command = match k {
            0 => "M",
            1 => "L",
            _ => " ",
        };
        let _ = write!(text, "{command}{},{}", decimal(p.x, DECIMALS), decimal(height_mm - p.y, DECIMALS));
    }
    text.push_str("\"/>\n");
}

/// Text that XML takes as it is meant; characters that XML 1.0 forbids become spaces.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => out.push(' '),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::{Boundary, Iso};

    use super::super::tests::{drawing, polyline};
    use super::*;

    #[test]
    fn layers_are_groups_and_y_points_down() {
        let lines = vec![
            polyline(Boundary, 1, &[[0.0, 0.0], [10.0, 0.0], [10.0, 20.12345]]),
            polyline(Iso, 2, &[[1.0, 1.0], [2.0, 2.0]]),
            polyline(Boundary, 3, &[[1.0, 1.0], [2.0, 2.0]]),
            polyline(Boundary, 1, &[[5.0, 50.0], [5.5, 50.0]]),
            polyline(Boundary, 1, &[[5.5, 50.0], [5.5, 49.0]]),
        ];
        let mut drawing = drawing(100.0, 50.0, lines);
        drawing.name = "a<b & \"c\"\u{1}".into();
        let expected = r##"<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" width="100mm" height="50mm" viewBox="0 0 100 50">
<title>a&lt;b &amp; &quot;c&quot; </title>
<g inkscape:groupmode="layer" inkscape:label="boundary pen 1" id="layer1" fill="none" stroke="#000000" stroke-width="0.3" stroke-linecap="round" stroke-linejoin="round">
<path d="M0,50L10,50 10,29.877"/>
<path d="M5,0L5.5,0 5.5,1"/>
</g>
<g inkscape:groupmode="layer" inkscape:label="iso" id="layer2" fill="none" stroke="#c82828" stroke-width="0.3" stroke-linecap="round" stroke-linejoin="round">
<path d="M1,49L2,48"/>
</g>
<g inkscape:groupmode="layer" inkscape:label="boundary pen 3" id="layer3" fill="none" stroke="#1e50b4" stroke-width="0.3" stroke-linecap="round" stroke-linejoin="round">
<path d="M1,49L2,48"/>
</g>
</svg>
"##;
        assert_eq!(svg(&drawing, None), expected);
        let told = svg(&drawing, Some("penvis draw 'a&b' -o c.svg"));
        assert!(told.contains("<dc:source>penvis draw 'a&amp;b' -o c.svg</dc:source>"), "{told}");
    }
}
