//! What is drawn and how, when models and command line have both been heard: what the command line says goes first.

use penvis_core::extract::adaptive::Tone;
use penvis_core::extract::{CurveKind, CurveSet, Style, Styles};

use crate::drawing::Page;
use crate::fill::Fill;
use crate::isocurves::{Adaptive, DEFAULT_ISOS, Isocurves};
use crate::marking::{MARKS_LAYER, Marking, TITLE_LAYER};
use crate::model::Model;
use crate::options::{DrawingOptions, OptionError};
use crate::page::{Hidden, Ink, Inks, Layout, Placing};
use crate::pens::Pens;
use crate::style::StyleChoice;

/// How a model is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Settled {
    /// The sheet.
    pub page: Page,
    /// Margin on all sides of the sheet in mm, to which marks and a title reach.
    pub edge_mm: f64,
    /// Margin on all sides of the picture in mm: that of the sheet, and what marks and a title take of it.
    pub margin_mm: f64,
    /// What is drawn beside the picture, if anything is.
    pub marking: Marking,
    /// Size and place of the picture on it.
    pub placing: Placing,
    /// Largest distance in mm between a curve and its polyline.
    pub tolerance_mm: f64,
    /// What of each surface is drawn.
    pub styles: Styles,
    /// Which pen draws what.
    pub inks: Inks,
    /// What is known of the pens.
    pub pens: Pens,
    /// Isocurves that are not so many a direction.
    pub adaptive: Option<Adaptive>,
    /// What each surface is filled with, by its index.
    pub fills: Vec<Option<Fill>>,
    /// What makes lines of fills end.
    pub tone: Option<Tone>,
    /// Isocurves a direction if they are as many on all surfaces, else 0.
    pub isos: u32,
    /// Most sheets in front of what is drawn.
    pub deepest: u32,
}

impl Settled {
    /// Of a model and what was asked for.
    ///
    /// # Errors
    /// If a sheet is none, or the margins leave nothing of it.
    pub fn new(options: &DrawingOptions, model: &Model) -> Result<Self, OptionError> {
        let sheet = options.sheet.or(&model.sheet);
        let (page, edge_mm) = sheet.settle()?;
        let is_marking = |layer: &str| matches!(layer, MARKS_LAYER | TITLE_LAYER);
        let (marking_pens, layer_pens) =
            options.layer_pens.clone().into_iter().partition(|(layer, _)| is_marking(layer));
        let marking = sheet.marking(marking_pens);
        let margin_mm = edge_mm + marking.band_mm();
        Layout::room(page, margin_mm)?;
        let choices = model.choices();
        let looks: Vec<(Style, Ink)> = choices.iter().map(|&c| look(options, c)).collect();
        let (styles, inks): (Vec<Style>, Vec<Ink>) = looks.into_iter().unzip();
        let adaptive = match options.isocurves {
            Some(Isocurves::Adaptive(adaptive)) if styles.iter().any(|s| s.curves.iso) => Some(adaptive),
            _ => None,
        };
        let pens = Pens::new(model.pens.clone(), options.pen_width_mm);
        let inks = Inks::new(inks).with_layers(layer_pens);
        let fill = |(surface, choice): (usize, &StyleChoice)| {
            let pen = inks.visible(surface, CurveKind::Hatch, CurveKind::Hatch.name());
            options.style.fill.or(choice.fill).settle(pen, pens.width_mm(pen), options.tone.is_some())
        };
        let fills = choices.iter().enumerate().map(fill).collect();
        let is_omitted = (0..choices.len()).all(|surface| inks.of(surface).hidden == Hidden::Omit);
        let isos = match styles.split_first() {
            Some((first, rest)) if rest.iter().all(|s| s.isos == first.isos) => first.isos,
            _ => 0,
        };
        Ok(Self {
            page,
            edge_mm,
            margin_mm,
            marking,
            placing: sheet.placing(),
            tolerance_mm: sheet.settled_tolerance_mm(),
            styles: Styles::new(styles),
            inks,
            pens,
            adaptive,
            fills,
            tone: options.tone,
            isos,
            deepest: if is_omitted { 0 } else { options.deepest },
        })
    }
}

/// How a surface is drawn for which a model asks this.
fn look(options: &DrawingOptions, model: StyleChoice) -> (Style, Ink) {
    let choice = options.style.or(model);
    let mut curves = choice.curves.unwrap_or_default();
    let isos = match options.isocurves {
        Some(Isocurves::Adaptive(_)) => None,
        Some(Isocurves::Uniform(count)) => Some(count),
        None => Some(choice.isos.unwrap_or(DEFAULT_ISOS)),
    };
    // Lines of a fill stand for the surface as isocurves do.
    let asked =
        choice.curves.is_some() || choice.isos.is_some() || matches!(options.isocurves, Some(Isocurves::Uniform(_)));
    let is_filled = choice.fill.kind.flatten().is_some();
    // None are not a kind that is drawn.
    curves = CurveSet { iso: curves.iso && isos != Some(0) && (asked || !is_filled), ..curves };
    let isos = if curves.iso { isos.unwrap_or(0) } else { 0 };
    let hidden = match choice.hidden.unwrap_or_default() {
        // Depths that are told apart are drawn.
        Hidden::Omit if options.tells_depths() => Hidden::Layer,
        hidden => hidden,
    };
    (Style { curves, isos }, Ink { pens: choice.pens, hidden })
}
