//! The pens of a scene: their lines, and how they are moved.

use std::collections::BTreeMap;
use std::str::FromStr;

use super::keys::{Item, Table};
use crate::model::fault::Fault;
use crate::pens::Pen;
use crate::style::MOST_PENS;

/// Keys of a pen.
const PEN: [&str; 5] = ["number", "width", "color", "speed", "force"];

/// Largest force in steps. Plotters know up to 8.
const MOST_FORCE: u32 = 99;

/// The pens that a list of tables describes, by number.
///
/// # Errors
/// If one has an unknown key, no number or that of another one, or a value that makes no sense.
pub(super) fn pens(list: &Item<'_>) -> Result<BTreeMap<u32, Pen>, Fault> {
    let items = list.items().map_err(|_| list.fault("must be a list of tables; write [[pen]] above each of them"))?;
    let mut pens = BTreeMap::new();
    for item in items {
        let table = item.table("a pen", &PEN)?;
        let number = table.need("number")?;
        let pen = number.whole(1, MOST_PENS)?;
        if pens.insert(pen, properties(&table)?).is_some() {
            return Err(number.fault(format!("is {pen} again; describe each pen once")));
        }
    }
    Ok(pens)
}

fn properties(table: &Table<'_>) -> Result<Pen, Fault> {
    let positive = |key, wanted| {
        let number = table.get(key).map(|item: Item<'_>| item.number_that(|x| x > 0.0 && x <= 1000.0, wanted));
        number.transpose()
    };
    Ok(Pen {
        width_mm: positive("width", "a width in mm, more than 0")?,
        color: table.get("color").map(|item| color(&item)).transpose()?,
        speed_mm_s: positive("speed", "a speed in mm/s, more than 0")?,
        force: table.get("force").map(|item| item.whole(1, MOST_FORCE)).transpose()?,
    })
}

fn color(item: &Item<'_>) -> Result<[u8; 3], Fault> {
    let color = svgtypes::Color::from_str(item.text()?);
    let color = color.map_err(|_| item.fault("is no colour; give \"#c82828\", or a name of CSS such as \"navy\""))?;
    Ok([color.red, color.green, color.blue])
}
