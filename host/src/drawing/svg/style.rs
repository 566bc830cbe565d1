//! What style sheets and attributes say of an element, as far as a pen can do it.

use roxmltree::Node;
use simplecss::{DeclarationTokenizer, StyleSheet};
use svgtypes::{Length, Paint};

/// What an element is painted with.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Colour {
    None,
    /// `currentColor`.
    Current,
    Rgb([u8; 3]),
    /// A gradient, or a pattern.
    Other,
}

/// The properties that count for a pen and that the elements inside inherit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Style {
    fill: Colour,
    stroke: Colour,
    color: [u8; 3],
    is_visible: bool,
    /// Whether its opacity is more than none.
    fill_shows: bool,
    stroke_shows: bool,
    stroke_has_width: bool,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            fill: Colour::Rgb([0; 3]),
            stroke: Colour::None,
            color: [0; 3],
            is_visible: true,
            fill_shows: true,
            stroke_shows: true,
            stroke_has_width: true,
        }
    }
}

/// What an element itself says, which those inside do not inherit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Own {
    /// It is not displayed.
    is_hidden: bool,
    /// It is transparent.
    is_clear: bool,
    /// It is cut off at a path or a mask.
    pub(super) is_clipped: bool,
    /// It has markers at its vertices.
    pub(super) has_markers: bool,
}

impl Own {
    /// Whether neither it nor anything in it is drawn.
    pub(super) fn is_gone(&self) -> bool {
        self.is_hidden || self.is_clear
    }
}

impl Style {
    /// Whether any ink comes of a shape with this style, and of which colour, if that is one: the colour of its stroke, or else of its area.
    pub(super) fn ink(&self) -> Option<Option<[u8; 3]>> {
        let shown = |colour: Colour, shows: bool| match colour {
            Colour::None => None,
            _ if !(shows && self.is_visible) => None,
            Colour::Current => Some(Some(self.color)),
            Colour::Rgb(rgb) => Some(Some(rgb)),
            Colour::Other => Some(None),
        };
        shown(self.stroke, self.stroke_shows && self.stroke_has_width).or_else(|| shown(self.fill, self.fill_shows))
    }

    /// The style of an element within another one of this style. What is important goes before the rest; of that, the `style` attribute before the
    /// rules of style sheets, the more specific and later ones first, and these before other attributes.
    pub(super) fn of(&self, node: Node<'_, '_>, sheet: &StyleSheet<'_>) -> (Self, Own) {
        let (mut style, mut own) = (*self, Own::default());
        let element = Element(node);
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            style.apply(&mut own, self, attribute.name(), attribute.value());
        }
        let rules = sheet.rules.iter().filter(|rule| rule.selector.matches(&element));
        let rules: Vec<_> = rules.flat_map(|rule| &rule.declarations).copied().collect();
        let inline: Vec<_> =
            node.attribute("style").map(|text| DeclarationTokenizer::from(text).collect()).unwrap_or_default();
        for is_important in [false, true] {
            for declaration in rules.iter().chain(&inline).filter(|declaration| declaration.important == is_important) {
                style.apply(&mut own, self, declaration.name, declaration.value);
            }
        }
        (style, own)
    }

    /// Takes note of a property; a value that is none changes nothing.
    fn apply(&mut self, own: &mut Own, parent: &Self, name: &str, value: &str) {
        let value = value.trim();
        let inherits = value == "inherit";
        match name {
            "display" => own.is_hidden = value == "none",
            "opacity" => own.is_clear = is_nothing(value),
            "clip-path" | "mask" => own.is_clipped = value != "none",
            "marker" | "marker-start" | "marker-mid" | "marker-end" => own.has_markers |= value != "none",
            "visibility" if inherits => self.is_visible = parent.is_visible,
            "visibility" => self.is_visible = value == "visible",
            "fill" => self.fill = paint(value, parent.fill).unwrap_or(self.fill),
            "stroke" => self.stroke = paint(value, parent.stroke).unwrap_or(self.stroke),
            "fill-opacity" if !inherits => self.fill_shows = !is_nothing(value),
            "stroke-opacity" if !inherits => self.stroke_shows = !is_nothing(value),
            "stroke-width" if !inherits => self.stroke_has_width = !is_nothing(value),
            "color" => match Paint::from_str(value) {
                Ok(Paint::Color(color)) => self.color = [color.red, color.green, color.blue],
                Ok(Paint::Inherit) => self.color = parent.color,
                _ => {}
            },
            _ => {}
        }
    }
}

fn paint(value: &str, inherited: Colour) -> Option<Colour> {
    Some(match Paint::from_str(value).ok()? {
        Paint::None => Colour::None,
        Paint::Inherit => inherited,
        Paint::CurrentColor => Colour::Current,
        Paint::Color(color) if color.alpha == 0 => Colour::None,
        Paint::Color(color) => Colour::Rgb([color.red, color.green, color.blue]),
        Paint::FuncIRI(..) | Paint::ContextFill | Paint::ContextStroke => Colour::Other,
    })
}

/// Whether an opacity or a width is zero.
fn is_nothing(value: &str) -> bool {
    value.parse::<Length>().is_ok_and(|length| length.number <= 0.0)
}

/// An element, as selectors see it.
struct Element<'a, 'i>(Node<'a, 'i>);

impl simplecss::Element for Element<'_, '_> {
    fn parent_element(&self) -> Option<Self> {
        self.0.parent_element().map(Element)
    }

    fn prev_sibling_element(&self) -> Option<Self> {
        self.0.prev_sibling_element().map(Element)
    }

    fn has_local_name(&self, name: &str) -> bool {
        self.0.tag_name().name() == name
    }

    fn attribute_matches(&self, local_name: &str, operator: simplecss::AttributeOperator<'_>) -> bool {
        self.0.attribute(local_name).is_some_and(|value| operator.matches(value))
    }

    fn pseudo_class_matches(&self, class: simplecss::PseudoClass<'_>) -> bool {
        // The others are of documents that somebody reads and clicks at.
        matches!(class, simplecss::PseudoClass::FirstChild) && self.0.prev_sibling_element().is_none()
    }
}

#[cfg(test)]
mod tests {
    use roxmltree::Document;

    use super::*;

    /// The ink of the element called `x`, with a style sheet.
    fn ink(css: &str, xml: &str) -> Option<Option<[u8; 3]>> {
        let document = Document::parse(xml).unwrap();
        let sheet = StyleSheet::parse(css);
        let node = document.descendants().find(|n| n.attribute("id") == Some("x")).unwrap();
        let mut style = Style::default();
        let mut is_gone = false;
        let mut above: Vec<_> = node.ancestors().filter(Node::is_element).collect();
        above.reverse();
        for node in above {
            let (inner, own) = style.of(node, &sheet);
            style = inner;
            is_gone |= own.is_gone();
        }
        style.ink().filter(|_| !is_gone)
    }

    const RED: Option<Option<[u8; 3]>> = Some(Some([255, 0, 0]));
    const BLUE: Option<Option<[u8; 3]>> = Some(Some([0, 0, 255]));

    #[test]
    fn the_colour_is_that_of_the_stroke_or_else_of_the_area() {
        let table = [
            ("<a id='x'/>", Some(Some([0; 3]))),
            ("<a id='x' fill='none'/>", None),
            ("<a id='x' fill='red'/>", RED),
            ("<a id='x' fill='red' stroke='#00f'/>", BLUE),
            ("<a fill='none' stroke='rgb(255,0,0)'><a id='x'/></a>", RED),
            ("<a color='red' stroke='currentColor'><a id='x'/></a>", RED),
            ("<a color='red' stroke='currentColor'><a id='x' color='blue'/></a>", BLUE),
            ("<a stroke='red'><a id='x' stroke='none' style='stroke:inherit'/></a>", RED),
            ("<a id='x' stroke='url(#g)'/>", Some(None)),
            ("<a id='x' style='fill:none;stroke:red;stroke-width:0'/>", None),
            ("<a id='x' fill='red' stroke='blue' stroke-opacity='0%'/>", RED),
            ("<a visibility='hidden'><a id='x'/></a>", None),
            ("<a visibility='hidden'><a id='x' visibility='visible' fill='red'/></a>", RED),
            ("<a display='none'><a id='x' display='inline'/></a>", None),
            ("<a opacity='0'><a id='x'/></a>", None),
        ];
        for (xml, expected) in table {
            assert_eq!(ink("", xml), expected, "{xml}");
        }
    }

    #[test]
    fn rules_go_by_importance_and_then_by_what_is_said_more_closely() {
        let table = [
            ("a{stroke:red}", "<a id='x' stroke='blue'/>", RED),
            ("a{stroke:red}", "<a id='x' style='stroke:blue'/>", BLUE),
            ("a{stroke:red !important}", "<a id='x' style='stroke:blue'/>", RED),
            ("#x{stroke:red} .k{stroke:blue}", "<a id='x' class='k'/>", RED),
            (".k{stroke:blue} .l{stroke:red}", "<a id='x' class='l k'/>", RED),
            ("g > a{stroke:red} a{stroke:blue}", "<g><a id='x'/></g>", RED),
            ("a:first-child{stroke:red}", "<g><b/><a id='x' stroke='blue'/></g>", BLUE),
        ];
        for (css, xml, expected) in table {
            assert_eq!(ink(css, xml), expected, "{css} {xml}");
        }
    }
}
