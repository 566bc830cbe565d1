//! The scene reader: TOML that puts models and shapes together and says how they are drawn.
//!
//! A list of `[[object]]`, each a `model` (a built-in one by name, or a file, whose path counts from the scene's own
//! folder) or a shape by its measures (`box`, `sphere`, `cylinder`, `cone`, `torus`, `rectangle`, `disk`). An object is scaled
//! first, then rotated, then moved (`scale`, `rotate`, `translate`), and then repeated (`array`). `pen`, `curves`, `iso`,
//! `hidden`, `fill` and `crease_angle` say how it is drawn, and all but the last of them, in a table of its name in the object's `surface`, how one of
//! its surfaces is; `[style]` says so for all objects that do not say otherwise. `[camera]` and
//! `[page]` are what the options of the same names are, and each `[[pen]]` says how wide a pen is, and how it is moved. Whatever the command line asks for goes before the file.
//!
//! A model may be a scene in its turn, some levels deep, but not a part of itself. Its objects then keep their own styles
//! where the object that they make up has none; its camera, its page and its pens do not count.
//!
//! Placements are affine, so that surfaces and trims stay exact, and a solid that is mirrored is still one whose faces face
//! outwards.

mod assembly;
mod frame;
mod keys;
mod object;
mod pen;
mod place;
mod shape;
mod surfaces;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use penvis_core::scene::Scene;

use self::assembly::{Assembled, Assembly};
use self::keys::{Lines, Table};
use self::object::{Look, Object, STYLE};
use super::aim::ViewChoice;
use super::fault::{Fault, ReadError};
use super::format::ModelFormat;
use super::import::{Import, Reading};
use super::source::Source;
use super::view::View;
use crate::style::SheetChoice;

/// Several models in one picture.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "scene", extensions: &["toml"], looks_like: |source| looks_like(source.head()), read };

/// Most bytes of a scene file. It is written by hand, and what is in it ten thousand times is an array.
const LARGEST: u64 = 1 << 20;

/// Whether a line of a text begins a list of objects.
fn looks_like(head: &[u8]) -> bool {
    head.split(|&byte| byte == b'\n').any(|line| line.trim_ascii_start().starts_with(b"[[object]]"))
}

fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
    if source.length() > LARGEST {
        return Err(ReadError::TooLarge { limit: LARGEST });
    }
    let bytes = source.bytes()?;
    let text = match str::from_utf8(&bytes) {
        Ok(text) => text,
        Err(error) => {
            let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
            return Err(Fault::line(line, "is not UTF-8, as TOML is; save the file as UTF-8").into());
        }
    };
    let lines = Lines::of(text);
    let entries = keys::parse(text, &lines)?;
    let known = ["name", "object", "style", "camera", "page", "pen"];
    let file = Table::whole(entries.get_ref(), &lines, "a scene", &known)?;

    let (style, camera, page) = (file.get("style"), file.get("camera"), file.get("page"));
    let common = style.map_or(Ok(Look::default()), |item| Look::new(&item.table("[style]", &STYLE)?))?;
    let (view, aim) = match &camera {
        Some(item) => frame::camera(&item.table("[camera]", &frame::CAMERA)?)?,
        None => (None, ViewChoice::default()),
    };
    let sheet = page.map_or(Ok(SheetChoice::default()), |item| frame::page(&item.table("[page]", &frame::PAGE)?))?;
    let pens = file.get("pen").map_or(Ok(BTreeMap::new()), |item| pen::pens(&item))?;
    let name = file.get("name").map(|item| item.text()).transpose()?.unwrap_or(source.stem()).to_owned();
    let Some(list) = file.get("object") else {
        return Err(Fault::whole("has no [[object]]; `penvis scene --init` writes a scene to begin with").into());
    };
    let objects =
        list.items().map_err(|_| list.fault("must be a list of tables; write [[object]] above each of them"))?;

    let mut assembly = Assembly::new(source, reading, common)?;
    for (index, item) in objects.iter().enumerate() {
        reading.progress(index, objects.len())?;
        assembly.add(Object::new(item)?)?;
    }
    let Assembled { scenes, styles, files, report } = assembly.finish();
    let scene = Scene::joined(name, scenes);
    check_view(view, aim, &scene).map_err(|problem| match &camera {
        Some(item) => Fault::line(item.line, problem),
        None => Fault::whole(problem),
    })?;
    Ok(Import { scene, view, aim, styles, sheet, pens, files, report })
}

/// Whether the camera has a view of the scene.
fn check_view(view: Option<View>, aim: ViewChoice, scene: &Scene) -> Result<(), String> {
    aim.resolve(view, scene).camera().map(drop).map_err(|error| error.to_string())
}
