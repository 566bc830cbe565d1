//! Lengths, and what they are measured in.

use glam::{DAffine2, DVec2};
use roxmltree::Node;
use svgtypes::{Align, AspectRatio, Length, LengthUnit, ViewBox};

/// CSS pixels an inch.
const DPI: f64 = 96.0;

/// Height of the font that lengths in `em` go by: what is drawn has no other.
const EM_PX: f64 = 16.0;

/// Along what a length is measured, for percentages.
#[derive(Clone, Copy, Debug)]
pub(super) enum Along {
    Width,
    Height,
    /// Neither: a radius.
    Diagonal,
}

/// The area that percentages go by, in its own units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Viewport(pub(super) DVec2);

impl Viewport {
    /// The length that an attribute says, in units; none if it is not there or says none.
    pub(super) fn length(self, node: Node<'_, '_>, name: &str, along: Along) -> Option<f64> {
        let length: Length = node.attribute(name)?.trim().parse().ok()?;
        Some(match length.unit {
            LengthUnit::Percent => {
                let whole = match along {
                    Along::Width => self.0.x,
                    Along::Height => self.0.y,
                    Along::Diagonal => self.0.length() / std::f64::consts::SQRT_2,
                };
                length.number / 100.0 * whole
            }
            _ => px(length),
        })
    }
}

/// A length that is no percentage, in pixels.
fn px(length: Length) -> f64 {
    let unit = match length.unit {
        LengthUnit::None | LengthUnit::Px | LengthUnit::Percent => 1.0,
        LengthUnit::Em => EM_PX,
        LengthUnit::Ex => EM_PX / 2.0,
        LengthUnit::In => DPI,
        LengthUnit::Cm => DPI / 2.54,
        LengthUnit::Mm => DPI / 25.4,
        LengthUnit::Pt => DPI / 72.0,
        LengthUnit::Pc => DPI / 6.0,
    };
    length.number * unit
}

/// Millimetres a pixel.
pub(super) const MM_PER_PX: f64 = 25.4 / DPI;

/// The box that an element wants to see; none if it says none.
pub(super) fn view_box(node: Node<'_, '_>) -> Option<ViewBox> {
    node.attribute("viewBox")?.parse().ok()
}

/// How what an element holds is put into an area that is so large, and the viewport there.
pub(super) fn fit(node: Node<'_, '_>, size: DVec2) -> (DAffine2, Viewport) {
    let Some(view) = view_box(node) else { return (DAffine2::IDENTITY, Viewport(size)) };
    let (low, inner) = (DVec2::new(view.x, view.y), DVec2::new(view.w, view.h));
    let ratio: AspectRatio =
        node.attribute("preserveAspectRatio").and_then(|text| text.parse().ok()).unwrap_or_default();
    let scale = size / inner;
    let scale = match ratio.align {
        Align::None => scale,
        _ if ratio.slice => DVec2::splat(scale.max_element()),
        _ => DVec2::splat(scale.min_element()),
    };
    let share = match ratio.align {
        Align::None | Align::XMinYMin => DVec2::ZERO,
        Align::XMidYMin => DVec2::new(0.5, 0.0),
        Align::XMaxYMin => DVec2::new(1.0, 0.0),
        Align::XMinYMid => DVec2::new(0.0, 0.5),
        Align::XMidYMid => DVec2::splat(0.5),
        Align::XMaxYMid => DVec2::new(1.0, 0.5),
        Align::XMinYMax => DVec2::new(0.0, 1.0),
        Align::XMidYMax => DVec2::new(0.5, 1.0),
        Align::XMaxYMax => DVec2::ONE,
    };
    let room = (size - inner * scale) * share;
    (DAffine2::from_scale_angle_translation(scale, 0.0, room - low * scale), Viewport(inner))
}

/// Width and height of a whole drawing in pixels. One that is not said, or a percentage, follows from the view box, and from the other one.
///
/// # Errors
/// If they say no size; what to do.
pub(super) fn size(root: Node<'_, '_>) -> Result<DVec2, String> {
    let view = view_box(root);
    let said = |name: &str| -> Result<Option<f64>, String> {
        let Some(text) = root.attribute(name).map(str::trim).filter(|text| *text != "auto") else { return Ok(None) };
        let wrong = |_| format!("says a {name} that is no length, `{text}`; give a number of mm, cm, in, pt or px");
        let length: Length = text.parse().map_err(wrong)?;
        Ok((length.unit != LengthUnit::Percent).then(|| px(length)))
    };
    let size = match (said("width")?, said("height")?, view) {
        (Some(width), Some(height), _) => DVec2::new(width, height),
        (Some(width), None, Some(view)) => DVec2::new(width, width * view.h / view.w),
        (None, Some(height), Some(view)) => DVec2::new(height * view.w / view.h, height),
        (None, None, Some(view)) => DVec2::new(view.w, view.h),
        _ => return Err("says no size; give the svg element width and height, or a viewBox".into()),
    };
    Ok(size)
}

#[cfg(test)]
mod tests {
    use roxmltree::Document;

    use super::*;

    fn with<T>(attributes: &str, look: impl Fn(Node<'_, '_>) -> T) -> T {
        look(Document::parse(&format!("<svg {attributes}/>")).unwrap().root_element())
    }

    #[test]
    fn sizes_are_in_units_or_follow_from_the_box() {
        let mm = |attributes: &str| with(attributes, size).map(|size| size * MM_PER_PX);
        let close = |attributes: &str, width: f64, height: f64| {
            let found = mm(attributes).unwrap();
            assert!(found.distance(DVec2::new(width, height)) < 1e-9, "{attributes} gave {found}");
        };
        close("width='280mm' height='20cm'", 280.0, 200.0);
        close("width='96' height='1in'", 25.4, 25.4);
        close("width='72pt' height='6pc' viewBox='0 0 1 1'", 25.4, 25.4);
        close("width='100mm' viewBox='0 0 4 3'", 100.0, 75.0);
        close("height='75mm' width='100%' viewBox='0 0 4 3'", 100.0, 75.0);
        close("viewBox='-5 -5 96 192'", 25.4, 50.8);
        assert!(mm("width='100mm'").unwrap_err().contains("no size"));
        assert!(mm("width='many' height='3'").unwrap_err().contains("says a width that is no length, `many`"));
        assert!(mm("width='auto' height='3'").unwrap_err().contains("no size"));
    }

    #[test]
    fn boxes_are_put_where_they_are_wanted() {
        let on = |attributes: &str, p: [f64; 2]| {
            with(attributes, |node| fit(node, DVec2::new(200.0, 100.0)).0.transform_point2(p.into()))
        };
        assert_eq!(on("", [3.0, 4.0]), DVec2::new(3.0, 4.0));
        assert_eq!(on("viewBox='10 10 10 10'", [10.0, 10.0]), DVec2::new(50.0, 0.0));
        assert_eq!(on("viewBox='10 10 10 10' preserveAspectRatio='xMaxYMid'", [20.0, 20.0]), DVec2::new(200.0, 100.0));
        assert_eq!(on("viewBox='0 0 10 10' preserveAspectRatio='none'", [10.0, 1.0]), DVec2::new(200.0, 10.0));
        assert_eq!(on("viewBox='0 0 10 10' preserveAspectRatio='xMidYMid slice'", [0.0, 0.0]), DVec2::new(0.0, -50.0));
    }

    #[test]
    fn percentages_go_by_the_viewport() {
        let of = |along| with("a='50%'", |node| Viewport(DVec2::new(30.0, 40.0)).length(node, "a", along).unwrap());
        assert_eq!([of(Along::Width), of(Along::Height)], [15.0, 20.0]);
        assert!((of(Along::Diagonal) - 25.0 / 2.0_f64.sqrt()).abs() < 1e-12);
    }
}
