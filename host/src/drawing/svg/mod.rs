//! The SVG reader: the strokes of what it paints, with layers and colours, in millimetres.
//!
//! A pen draws lines, not areas: each shape that shows is drawn by its outline. What a pen cannot do is told and left out.

mod path;
mod shape;
mod style;
mod viewport;

use std::collections::{BTreeMap, HashMap};

use glam::{DAffine2, DVec2};
use roxmltree::{Document, Node, ParsingOptions};
use simplecss::StyleSheet;

use self::path::PathError;
use self::style::Style;
use self::viewport::{Along, MM_PER_PX, Viewport};
use super::file::{Found, Reading};
use super::flatten::{Flattener, LONGEST_MM};
use super::{Drawing, LAYER, Page, Polyline};
use crate::message::one_line;
use crate::model::{Fault, ReadError, Source};
use crate::pens::Pens;

/// Most elements, counted each time that a `use` draws them again.
const MOST_ELEMENTS: usize = 1_000_000;

/// Most nodes of XML: elements, and the texts between them.
const MOST_NODES: u32 = 4_000_000;

/// Most elements within one another. Programs make some tens of groups in groups at most.
const DEEPEST: usize = 256;

/// Longest name of a layer in characters.
const LONGEST_NAME: usize = 60;

const SVG: &str = "http://www.w3.org/2000/svg";
const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";
const XLINK: &str = "http://www.w3.org/1999/xlink";

/// The drawing in an SVG file: where it says that it is on a page as large as it says, an inch being 96 pixels.
///
/// Layers are the layers of Inkscape, or else the groups at the top that have an `id`, or else the colours, if they are several; the pens are
/// numbered as layers begin. Curves are no farther from their polylines than `reading` says.
///
/// Cost and memory: linear in the file, and in what its `use` elements repeat, which is bounded.
///
/// # Errors
/// [`ReadError`] with the line, and the element if it has an `id`, whatever the bytes are.
pub fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Found, ReadError> {
    read_most(source, reading, MOST_ELEMENTS)
}

/// [`read`] with so many elements at the most.
fn read_most(source: &mut Source, reading: &Reading<'_>, most: usize) -> Result<Found, ReadError> {
    let bytes = source.bytes()?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Fault::whole("is no text in UTF-8; save it as plain SVG, not compressed and not in another encoding")
    })?;
    // Only what the document itself defines: nothing is fetched, and what stands for more than its like is refused.
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).map_err(|error| Fault::whole(error.to_string()))?;
    let root = document.root_element();
    if !is_svg(root) || root.tag_name().name() != "svg" {
        return Err(Fault::whole("is no SVG: its first element is not svg; check the path").into());
    }
    let size = viewport::size(root).map_err(Fault::whole)?;
    let page = Page { width_mm: size.x * MM_PER_PX, height_mm: size.y * MM_PER_PX };
    if ![page.width_mm, page.height_mm].iter().all(|side| (1.0..=LONGEST_MM).contains(side)) {
        let problem = format!(
            "is {:.1} × {:.1} mm large, which is no sheet; give width and height of 1 to {LONGEST_MM} mm",
            page.width_mm, page.height_mm
        );
        return Err(Fault::at("svg", problem).into());
    }
    let css: Vec<&str> = document
        .descendants()
        .filter(|node| is_svg(*node) && node.tag_name().name() == "style")
        .flat_map(|node| node.children().filter_map(|child| child.text()))
        .collect();
    let mut sheet = StyleSheet::new();
    css.iter().for_each(|text| sheet.parse_more(text));
    let mut ids = HashMap::new();
    for node in document.descendants() {
        if let Some(id) = node.attribute("id") {
            ids.entry(id).or_insert(node);
        }
    }
    let mut walk = Walk {
        sheet,
        ids,
        has_layers: document.descendants().any(is_layer),
        out: Flattener::new(reading.tolerance_mm),
        layers: Layers::default(),
        strokes: Vec::new(),
        most,
        left: most,
        undrawn: BTreeMap::new(),
        reading,
    };
    // From pixels, y down, to millimetres, y up.
    let paper =
        DAffine2::from_scale_angle_translation(DVec2::new(MM_PER_PX, -MM_PER_PX), 0.0, DVec2::new(0.0, page.height_mm));
    let (fit, viewport) = viewport::fit(root, size);
    let (style, own) = Style::default().of(root, &walk.sheet);
    if !own.is_gone() {
        let own = transform(root)?;
        let state = State { place: paper * own * fit, viewport, style, layer: None, is_copy: false, depth: 0 };
        walk.children(root, &state)?;
    }
    let name = title(root).unwrap_or_else(|| source.stem().to_owned());
    Ok(walk.found(name, page))
}

/// What holds for the elements of an element.
#[derive(Clone, Copy)]
struct State {
    /// From user units to the paper in mm.
    place: DAffine2,
    viewport: Viewport,
    style: Style,
    /// Index of the layer.
    layer: Option<usize>,
    /// Whether it is drawn again, by a `use`: on the layer of that.
    is_copy: bool,
    depth: usize,
}

/// The layers by index, each once.
#[derive(Default)]
struct Layers {
    names: Vec<String>,
    indices: HashMap<String, usize>,
}

impl Layers {
    fn index(&mut self, name: &str) -> usize {
        let name: String = one_line(name).chars().take(LONGEST_NAME).collect();
        let next = self.names.len();
        let index = *self.indices.entry(name.clone()).or_insert(next);
        if index == next {
            self.names.push(name);
        }
        index
    }
}

/// A stroke, with its layer and its colour, where there are such.
struct Stroke {
    layer: Option<usize>,
    colour: Option<[u8; 3]>,
    points: Vec<DVec2>,
}

struct Walk<'a, 'i> {
    sheet: StyleSheet<'a>,
    ids: HashMap<&'a str, Node<'a, 'i>>,
    /// Whether there are layers of Inkscape.
    has_layers: bool,
    out: Flattener,
    layers: Layers,
    strokes: Vec<Stroke>,
    /// Elements that may be drawn.
    most: usize,
    /// Those that still may.
    left: usize,
    /// What is not drawn or not as it is there, how often, and the line of the first.
    undrawn: BTreeMap<&'static str, (usize, u32)>,
    reading: &'a Reading<'a>,
}

impl<'a, 'i> Walk<'a, 'i> {
    fn children(&mut self, node: Node<'a, 'i>, state: &State) -> Result<(), ReadError> {
        node.children().filter(|child| is_svg(*child)).try_for_each(|child| self.element(child, state))
    }

    fn element(&mut self, node: Node<'a, 'i>, around: &State) -> Result<(), ReadError> {
        let name = node.tag_name().name();
        let is_group = matches!(name, "g" | "a" | "svg" | "switch" | "use");
        if !is_group && !is_shape(name) {
            if matches!(name, "text" | "image" | "foreignObject") && around.style.ink().is_some() {
                self.note(node, if name == "text" { TEXT } else { IMAGE });
            }
            return Ok(());
        }
        if around.depth == DEEPEST {
            return Err(too_deep(node));
        }
        let most = self.most;
        self.left = self.left.checked_sub(1).ok_or_else(|| {
            fault(
                node,
                format!(
                    "is one of more than {most} elements, each counted as often as it is used; draw less at a time"
                ),
            )
        })?;
        if self.left.is_multiple_of(1 << 12) && (self.reading.stops)() {
            return Err(ReadError::Stopped);
        }
        let (style, own) = around.style.of(node, &self.sheet);
        if own.is_gone() {
            return Ok(());
        }
        if own.is_clipped {
            self.note(node, CLIP);
        }
        if own.has_markers && is_shape(name) {
            self.note(node, MARKER);
        }
        let mut state = State { style, place: around.place * transform(node)?, depth: around.depth + 1, ..*around };
        match name {
            "g" => {
                if !state.is_copy {
                    state.layer = self.layer(node).or(state.layer);
                }
                self.children(node, &state)
            }
            "a" => self.children(node, &state),
            "switch" => match node.children().find(|child| is_svg(*child) && is_meant(*child)) {
                Some(child) => self.element(child, &state),
                None => Ok(()),
            },
            "svg" => self.inner(node, &state, None),
            "use" => self.copy(node, &state),
            _ => self.shape(node, &state),
        }
    }

    /// What an `svg` within another one holds, or a `symbol`; of the size that a `use` says, or its own.
    fn inner(&mut self, node: Node<'a, 'i>, state: &State, said: Option<[Option<f64>; 2]>) -> Result<(), ReadError> {
        let length = |name, along| state.viewport.length(node, name, along);
        let is_own = node.tag_name().name() == "svg";
        let own = [length("width", Along::Width), length("height", Along::Height)];
        let [width, height] = said.unwrap_or_default();
        let [own_width, own_height] = if is_own { own } else { [None; 2] };
        let whole = state.viewport.0;
        let size = DVec2::new(width.or(own_width).unwrap_or(whole.x), height.or(own_height).unwrap_or(whole.y));
        if !size.cmpgt(DVec2::ZERO).all() {
            return Ok(());
        }
        let at = if is_own {
            DVec2::new(length("x", Along::Width).unwrap_or(0.0), length("y", Along::Height).unwrap_or(0.0))
        } else {
            DVec2::ZERO
        };
        let (fit, viewport) = viewport::fit(node, size);
        let place = state.place * DAffine2::from_translation(at) * fit;
        self.children(node, &State { place, viewport, ..*state })
    }

    /// What a `use` draws.
    fn copy(&mut self, node: Node<'a, 'i>, state: &State) -> Result<(), ReadError> {
        let link = node.attribute("href").or_else(|| node.attribute((XLINK, "href")));
        let target = link.and_then(|link| link.trim().strip_prefix('#')).and_then(|id| self.ids.get(id).copied());
        let Some(target) = target.filter(|target| is_svg(*target)) else {
            self.note(node, LINK);
            return Ok(());
        };
        let length = |name, along| state.viewport.length(node, name, along);
        let at = DVec2::new(length("x", Along::Width).unwrap_or(0.0), length("y", Along::Height).unwrap_or(0.0));
        let place = state.place * DAffine2::from_translation(at);
        let state = State { place, is_copy: true, ..*state };
        let size = [length("width", Along::Width), length("height", Along::Height)];
        match target.tag_name().name() {
            name @ ("svg" | "symbol") => {
                if state.depth == DEEPEST {
                    return Err(too_deep(node));
                }
                let (style, own) = state.style.of(target, &self.sheet);
                if own.is_gone() {
                    return Ok(());
                }
                let own = if name == "symbol" { transform(target)? } else { DAffine2::IDENTITY };
                let place = state.place * own;
                self.inner(target, &State { style, place, depth: state.depth + 1, ..state }, Some(size))
            }
            _ => self.element(target, &state),
        }
    }

    fn shape(&mut self, node: Node<'a, 'i>, state: &State) -> Result<(), ReadError> {
        let Some(colour) = state.style.ink() else { return Ok(()) };
        match shape::draw(node, state.viewport, &state.place, &mut self.out) {
            Ok(()) => {}
            Err(PathError::Data) => self.note(node, DATA),
            Err(PathError::Geometry(problem)) => return Err(fault(node, problem)),
        }
        let lines = self.out.take();
        self.strokes.extend(lines.into_iter().map(|points| Stroke { layer: state.layer, colour, points }));
        Ok(())
    }

    /// The layer that a group is.
    fn layer(&mut self, node: Node<'_, '_>) -> Option<usize> {
        let id = node.attribute("id");
        let name = if self.has_layers {
            is_layer(node).then(|| node.attribute((INKSCAPE, "label")).or(id).unwrap_or("layer"))
        } else {
            id.filter(|_| node.parent_element().is_some_and(|parent| parent.parent_element().is_none()))
        };
        name.map(|name| self.layers.index(name))
    }

    fn note(&mut self, node: Node<'_, '_>, what: &'static str) {
        self.undrawn.entry(what).or_insert_with(|| (0, line(node))).0 += 1;
    }

    /// The drawing of the strokes that were found.
    fn found(self, name: String, page: Page) -> Found {
        let Self { strokes, layers, undrawn, .. } = self;
        let mut names = layers.names;
        let first = strokes.first().and_then(|stroke| stroke.colour);
        // Without layers, what is of another colour is another layer.
        let by_colour = strokes.iter().all(|s| s.layer.is_none()) && strokes.iter().any(|s| s.colour != first);
        let mut colour_names: HashMap<[u8; 3], usize> = HashMap::new();
        let mut numbers: HashMap<Option<usize>, u32> = HashMap::new();
        let mut colours = BTreeMap::new();
        let mut polylines = Vec::with_capacity(strokes.len());
        for Stroke { layer, colour, points } in strokes {
            let layer = match colour {
                Some(rgb) if by_colour => Some(*colour_names.entry(rgb).or_insert_with(|| {
                    let [r, g, b] = rgb;
                    names.push(format!("#{r:02x}{g:02x}{b:02x}"));
                    names.len() - 1
                })),
                _ => layer,
            };
            let next = numbers.len() as u32 + 1;
            let pen = *numbers.entry(layer).or_insert(next);
            let name = layer.and_then(|index| names.get(index)).map_or(LAYER, String::as_str);
            if let Some(colour) = colour {
                colours.entry(pen).or_insert(colour);
            }
            polylines.push(Polyline::stroke(name, pen, points));
        }
        let notes =
            undrawn.into_iter().map(|(what, (count, line))| format!("{count} × {what} (the first in line {line})"));
        let drawing = Drawing { name, page, isos: 0, pens: Pens::default(), slack_mm: 0.0, polylines };
        Found { drawing, view: None, colours, notes: notes.collect() }
    }
}

const TEXT: &str = "text is not drawn; turn it into paths first";
const IMAGE: &str = "an image is not drawn; trace it first";
const CLIP: &str = "a clip or a mask cuts nothing off; cut the paths themselves";
const MARKER: &str = "a path with markers is drawn without them; turn them into paths first";
const LINK: &str = "a use names nothing in this file, and is not drawn";
const DATA: &str = "a path is drawn up to where its data cannot be read";

fn is_svg(node: Node<'_, '_>) -> bool {
    node.is_element() && matches!(node.tag_name().namespace(), None | Some(SVG))
}

fn is_layer(node: Node<'_, '_>) -> bool {
    is_svg(node) && node.tag_name().name() == "g" && node.attribute((INKSCAPE, "groupmode")) == Some("layer")
}

fn is_shape(name: &str) -> bool {
    matches!(name, "path" | "rect" | "circle" | "ellipse" | "line" | "polyline" | "polygon")
}

/// Whether an element in a `switch` is for readers that can do no more than SVG and read English.
fn is_meant(node: Node<'_, '_>) -> bool {
    let speaks = |list: &str| list.split(',').any(|language| language.trim().split('-').next() == Some("en"));
    !node.has_attribute("requiredExtensions") && node.attribute("systemLanguage").is_none_or(speaks)
}

/// The transform that an element says.
///
/// # Errors
/// If it cannot be read: what it holds would be in the wrong place.
fn transform(node: Node<'_, '_>) -> Result<DAffine2, ReadError> {
    let Some(text) = node.attribute("transform") else { return Ok(DAffine2::IDENTITY) };
    let t: svgtypes::Transform =
        text.parse().map_err(|error| fault(node, format!("has a transform that cannot be read: {error}")))?;
    Ok(DAffine2::from_cols_array(&[t.a, t.b, t.c, t.d, t.e, t.f]))
}

/// The title of the whole, if it has one.
fn title(root: Node<'_, '_>) -> Option<String> {
    let title = root.children().find(|child| is_svg(*child) && child.tag_name().name() == "title")?;
    let name: String = one_line(title.text()?).trim().chars().take(LONGEST_NAME).collect();
    (!name.is_empty()).then_some(name)
}

fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

fn too_deep(node: Node<'_, '_>) -> ReadError {
    fault(node, format!("is within {DEEPEST} others, or in a use of itself; leave groups out"))
}

fn fault(node: Node<'_, '_>, problem: String) -> ReadError {
    let id = node.attribute("id").map(|id| format!(", #{}", id.chars().take(LONGEST_NAME).collect::<String>()));
    let place = format!("line {}, {}{}", line(node), node.tag_name().name(), id.unwrap_or_default());
    Fault::at(place, problem).into()
}

#[cfg(test)]
mod tests;
