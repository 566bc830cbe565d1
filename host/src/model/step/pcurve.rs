//! Parameter curves of edges: where the file says that an edge runs on a surface.

use glam::DVec3;
use penvis_core::nurbs::Curve;
use penvis_core::pull_back::{PullBack, PullBackError};

use super::super::fault::Fault;
use super::curve::{self, Arc, Basis, Shape};
use super::exchange::Entity;
use super::parameters::Parameters;
use super::units::Units;

/// A parameter curve, as the file has it.
#[derive(Clone, Debug)]
pub(super) struct ParameterCurve {
    basis: Basis,
    /// Radians in a unit of angle.
    angle: f64,
}

/// What there is to say about parameter curves that are no trims.
#[derive(Debug, Default)]
pub(super) struct Given {
    /// Those that are not where their edges are.
    pub(super) apart: Vec<Apart>,
    /// What is wrong with those that could not be read.
    pub(super) unread: Vec<Fault>,
}

/// How far a parameter curve is from its edge.
#[derive(Clone, Copy, Debug)]
pub(super) enum Apart {
    /// By so many millimetres, or more.
    By(f64),
    /// It leads beyond the surface.
    Beyond,
}

impl Apart {
    /// Why a curve is no trim.
    pub(super) fn of(error: &PullBackError) -> Self {
        match error {
            PullBackError::Apart { distance, .. } | PullBackError::Off { distance, .. } => Self::By(*distance),
            _ => Self::Beyond,
        }
    }

    /// The one of two that is nearer.
    pub(super) fn nearer(self, other: Option<Self>) -> Self {
        match (self, other) {
            (Self::By(a), Some(Self::By(b))) => Self::By(a.min(b)),
            (Self::Beyond, Some(other)) => other,
            (own, _) => own,
        }
    }
}

impl Given {
    /// Takes in what there is to say about another face.
    pub(super) fn extend(&mut self, other: Self) {
        self.apart.extend(other.apart);
        self.unread.extend(other.unread);
    }

    /// Says it.
    pub(super) fn tell(&self, healed: &mut Vec<String>) {
        if !self.apart.is_empty() {
            let distances = self.apart.iter().filter_map(|a| if let Apart::By(d) = a { Some(*d) } else { None });
            let far = match distances.reduce(f64::max) {
                Some(far) => format!("up to {far:.3e} mm from their edges"),
                None => "beyond their surfaces".to_owned(),
            };
            let count = self.apart.len();
            healed.push(format!("{count} parameter curves that are {far} were left out, and the edges pulled back"));
        }
        if let Some(first) = self.unread.first() {
            let count = self.unread.len();
            healed.push(format!("{count} parameter curves were not understood, and their edges pulled back; {first}"));
        }
    }
}

/// The parameter curves that the curve of an edge has on a surface: two on a surface that closes there, the first for the
/// side that runs with the edge. What cannot be read is passed to `unread`.
pub(super) fn on_surface(
    edge_curve: Entity<'_>,
    surface: Entity<'_>,
    units: &Units,
    mut unread: impl FnMut(Fault),
) -> Vec<ParameterCurve> {
    const KINDS: &[&str] = &["SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE"];
    let Some((_, part)) = edge_curve.find_any(KINDS) else { return Vec::new() };
    let of_parameters = units.of_parameters();
    // In an entity of several types attributes come without the name.
    let list = part.entities(if edge_curve.is_simple() { 2 } else { 1 });
    let read = |entity: Entity<'_>| -> Result<Option<ParameterCurve>, Fault> {
        // A surface may stand for a curve on it that is not written.
        let Some(pcurve) = entity.find("PCURVE") else { return Ok(None) };
        let first = usize::from(entity.is_simple());
        if pcurve.entity(first)?.id() != surface.id() {
            return Ok(None);
        }
        let definition = pcurve.entity(first + 1)?;
        let Some(items) = definition.find("DEFINITIONAL_REPRESENTATION").or_else(|| definition.find("REPRESENTATION"))
        else {
            return Err(definition.fault("stands where a DEFINITIONAL_REPRESENTATION has to"));
        };
        match items.entities(usize::from(definition.is_simple()))?[..] {
            [item] => Ok(Some(ParameterCurve { basis: curve::basis(item, &of_parameters)?, angle: units.angle })),
            _ => Err(definition.fault("has more than one curve, or none")),
        }
    };
    let mut found = Vec::new();
    match list {
        Ok(entities) => {
            for entity in entities {
                match read(entity) {
                    Ok(curve) => found.extend(curve),
                    Err(fault) => unread(fault),
                }
            }
        }
        Err(fault) => unread(fault),
    }
    found
}

impl ParameterCurve {
    /// What of it may belong to a part of an edge on the curve `edge` in space, of which it is all if it is `whole`: by its
    /// parameter, which is mostly nearly that of the edge; or else all of it.
    pub(super) fn candidates(&self, edge: &Shape, arc: &Arc, whole: bool) -> Vec<Candidate> {
        let falls = arc.t[0] > arc.t[1];
        let rising = if falls { [arc.t[1], arc.t[0]] } else { arc.t };
        // Angles in space are radians by now, and those of parameters are in the unit of the file.
        let unit = |shape: &Shape| if matches!(shape, Shape::Ellipse(..)) { self.angle } else { 1.0 };
        let scale = unit(&self.basis.shape) / unit(edge);
        let mut t = rising.map(|t| t * scale);
        let mut out = Vec::new();
        if let Shape::Spline(curve, _) = &self.basis.shape {
            if let Some(period) = edge.period().map(|p| p * scale) {
                // The turn of the edge that the spline covers.
                let middle = 0.5 * (curve.domain()[0] + curve.domain()[1]);
                let turns = ((middle - 0.5 * (t[0] + t[1])) / period).round();
                t = t.map(|t| t + turns * period);
            }
            out.push(Candidate { curve: curve.clone(), part: Some(t), falls });
        } else if let Ok(curve) = self.basis.shape.over(t) {
            out.push(Candidate { curve, part: None, falls });
        }
        if whole {
            let all = match self.basis.part {
                Some((ends, forward)) => self.basis.shape.between(ends, ends[0] == ends[1], forward),
                None => self.basis.shape.whole(),
            };
            // A line has no whole.
            if let Ok([all]) = all.as_deref() {
                out.push(Candidate { curve: all.curve.clone(), part: None, falls });
            }
        }
        out
    }
}

/// What of a parameter curve may belong to a side.
pub(super) struct Candidate {
    /// In the parameters of the file.
    pub(super) curve: Curve,
    /// Where the part of it that is meant begins and ends, about; all of it if there is nothing.
    pub(super) part: Option<[f64; 2]>,
    /// Whether the side runs the other way.
    pub(super) falls: bool,
}

impl Candidate {
    /// Its image in the parameters of the surface that is drawn, if it has one that is a curve, for a side between two points.
    ///
    /// # Errors
    /// Why it is not on that surface.
    pub(super) fn image(
        &self,
        pull_back: &PullBack<'_>,
        parameters: Parameters,
        units: &Units,
        ends: [DVec3; 2],
    ) -> Result<Option<Curve>, PullBackError> {
        let ends = if self.falls { [ends[1], ends[0]] } else { ends };
        let directed = |curve: Curve| Some(if self.falls { curve.reversed() } else { curve });
        // A whole curve has the parameters of the part of it, but for what is round.
        let is_flat = matches!(parameters, Parameters::Own | Parameters::Plane(_));
        let mapped = |curve: &Curve| -> Result<Option<Curve>, PullBackError> {
            if matches!(parameters, Parameters::Own) {
                return Ok(Some(curve.clone()));
            }
            let Some(lifted) = parameters.lifted(curve, units) else { return Ok(None) };
            // Through a pole no parameter curve leads.
            let images = pull_back.curve(&lifted, units.tolerance)?.curves;
            Ok(<[Curve; 1]>::try_from(images).ok().map(|[image]| image))
        };
        let curve = match self.part {
            Some(part) if is_flat => {
                let Some(image) = mapped(&self.curve)? else { return Ok(None) };
                pull_back.part(&image, part, ends).ok()
            }
            Some(part) => match curve::cut(&self.curve, part) {
                Ok(part) => mapped(&part)?,
                Err(_) => None,
            },
            None => mapped(&self.curve)?,
        };
        Ok(curve.and_then(directed))
    }
}
