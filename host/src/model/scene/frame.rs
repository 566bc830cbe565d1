//! The camera and the page of a scene.

use glam::DVec3;

use super::keys::{Item, Table};
use crate::model::aim::{self, ViewChoice};
use crate::model::fault::Fault;
use crate::model::view::{Projection, View};
use crate::page::{self, Layout, Orientation, Position, Size};
use crate::style::SheetChoice;

/// Keys of the camera.
pub(super) const CAMERA: [&str; 5] = ["view", "up", "perspective", "eye", "target"];

/// Keys of the page.
pub(super) const PAGE: [&str; 11] =
    ["paper", "orientation", "margin", "tolerance", "scale", "width", "height", "position", "clip", "marks", "title"];

/// The view that the camera fixes, if it stands at a point, and what it asks of the view otherwise.
///
/// # Errors
/// If a key makes no sense, or goes with another one of those that are there.
pub(super) fn camera(table: &Table<'_>) -> Result<(Option<View>, ViewChoice), Fault> {
    let vector = |key| table.get(key).map(|item| item.numbers().map(|v| (item, DVec3::from(v)))).transpose();
    let direction = |key| match vector(key)? {
        Some((item, v)) if v.try_normalize().is_none() => {
            Err(item.fault("has no direction; give three finite numbers that are not all zero"))
        }
        found => Ok(found.map(|(_, v)| v)),
    };
    let up = direction("up")?;
    if let Some((_, eye)) = vector("eye")? {
        if let Some(item) = table.get("view").or(table.get("perspective")) {
            return Err(item.fault("does not go with `eye`, from which the view follows; leave one of them out"));
        }
        let target = table.need("target")?.numbers().map(DVec3::from)?;
        let view = View {
            eye_direction: eye - target,
            up: up.unwrap_or(DVec3::Z),
            projection: Projection::Perspective { eye, target },
        };
        return Ok((Some(view), ViewChoice::default()));
    }
    if let Some(item) = table.get("target") {
        return Err(item.fault("goes with `eye`, a point; for a direction there is `view`"));
    }
    let view = match table.get("view") {
        Some(item) if item.is_text() => {
            let name = item.text()?;
            let unknown = || item.fault(format!("is neither a direction [x, y, z] nor one of {}", aim::names()));
            Some(aim::named(name).ok_or_else(unknown)?)
        }
        _ => direction("view")?.map(aim::with_up),
    };
    let angle = table.get("perspective");
    let angle = angle.map(|item| item.number_that(|a| a > 0.0 && a < 180.0, "an angle between 0 and 180 degrees"));
    Ok((None, ViewChoice { direction: view, up, angle: angle.transpose()?.map(f64::to_radians) }))
}

/// The sheet and what is on it.
///
/// # Errors
/// If a key makes no sense, or the margins leave nothing of the sheet.
pub(super) fn page(table: &Table<'_>) -> Result<SheetChoice, Fault> {
    let orientation = table.get("orientation").map(|item| match item.text()? {
        "landscape" => Ok(Orientation::Landscape),
        "portrait" => Ok(Orientation::Portrait),
        _ => Err(item.fault("is not one of landscape, portrait")),
    });
    let margin = table.get("margin").map(|item| item.number_that(|mm| mm >= 0.0, "a length in mm, 0 or more"));
    let tolerance = table.get("tolerance").map(|item| item.number_that(|mm| mm > 0.0, "a length in mm, more than 0"));
    let sheet = SheetChoice {
        paper: table.get("paper").map(|item| item.text().map(str::to_owned)).transpose()?,
        orientation: orientation.transpose()?,
        margin_mm: margin.transpose()?,
        tolerance_mm: tolerance.transpose()?,
        size: size(table)?,
        position: table.get("position").map(position).transpose()?,
        clip: table.get("clip").map(|item| item.flag()).transpose()?,
        marks: table.get("marks").map(|item| item.flag()).transpose()?,
        title: table.get("title").map(|item| item.text().map(str::to_owned)).transpose()?,
    };
    let (page, margin_mm) = sheet.settle().map_err(|error| match table.get("paper") {
        Some(item) => item.fault(format!("is no paper: {error}")),
        None => table.fault(error.to_string()),
    })?;
    if let Err(error) = Layout::room(page, margin_mm) {
        let size = format!("leaves no room on a sheet of {} × {} mm; make it smaller", page.width_mm, page.height_mm);
        return Err(table.get("margin").map_or_else(|| table.fault(error.to_string()), |item| item.fault(size)));
    }
    Ok(sheet)
}

/// How large the picture is to be.
///
/// # Errors
/// If a key makes no sense, or several of them are there.
fn size(table: &Table<'_>) -> Result<Option<Size>, Fault> {
    let keys = ["scale", "width", "height"].map(|key| table.get(key));
    let mut given = keys.iter().flatten();
    if let (Some(_), Some(second)) = (given.next(), given.next()) {
        return Err(second.fault("is one size too many; give one of `scale`, `width`, `height`"));
    }
    let positive = |x: f64| x.is_finite() && x > 0.0;
    let side = |item: &Item<'_>| {
        let expected = "a length more than 0, as a number of mm or as text such as \"12cm\"";
        if !item.is_text() {
            return item.number_that(positive, expected);
        }
        let length = page::length_mm(item.text()?).filter(|&mm| positive(mm));
        length.ok_or_else(|| item.fault(format!("is not {expected}")))
    };
    let ratio = |item: &Item<'_>| {
        if !item.is_text() {
            return item.number_that(positive, "a ratio, as a number or as text such as \"1:2\"");
        }
        page::scale(item.text()?)
            .ok_or_else(|| item.fault("is no ratio \"paper:model\"; \"1:2\" is half the model's size"))
    };
    let [scale, width, height] = &keys;
    Ok(match (scale, width, height) {
        (Some(item), ..) => Some(Size::Scale(ratio(item)?)),
        (_, Some(item), _) => Some(Size::Width(side(item)?)),
        (.., Some(item)) => Some(Size::Height(side(item)?)),
        (None, None, None) => None,
    })
}

fn position(item: Item<'_>) -> Result<Position, Fault> {
    let expected =
        "is neither \"center\" nor two lengths \"X,Y\" from the lower left corner of the sheet, such as \"20mm,30mm\"";
    page::position(item.text()?).ok_or_else(|| item.fault(expected))
}
