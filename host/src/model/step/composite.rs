//! Composite curves: curves that follow one another.

use glam::DVec4;
use penvis_core::nurbs::{Curve, KnotVector, NurbsError};

use super::super::fault::Fault;
use super::curve::{self, Arc};
use super::exchange::Entity;
use super::units::Units;

/// Most polynomial pieces of a composite curve.
const MOST_PIECES: usize = 1 << 16;

/// The curve that an entity is, if it is a composite one, reached through `depth` curves: as one B-spline curve, whose parameter
/// runs by 1 over each polynomial piece. Where two of its curves end apart by no more than the tolerance, the first one's end
/// counts.
///
/// # Errors
/// If one of the curves is not read or has no end, or does not begin where the one before it ends.
pub(super) fn composite(entity: Entity<'_>, units: &Units, depth: usize) -> Result<Option<Curve>, Fault> {
    let Some(own) = entity.find("COMPOSITE_CURVE") else { return Ok(None) };
    let mut pieces: Vec<Vec<DVec4>> = Vec::new();
    for segment in own.entities(usize::from(entity.is_simple()))? {
        const KINDS: &[&str] = &["COMPOSITE_CURVE_SEGMENT", "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT"];
        let Some((_, part)) = segment.find_any(KINDS) else {
            return Err(segment.fault("stands where a COMPOSITE_CURVE_SEGMENT has to"));
        };
        let basis = curve::basis_within(part.entity(2)?, units, depth + 1)?;
        let arcs = match basis.part {
            Some((ends, forward)) => basis.shape.between(ends, ends[0] == ends[1], forward),
            None => basis.shape.whole(),
        };
        let mut arcs = arcs.map_err(|e| segment.fault(format!("has a curve that {e}")))?;
        if !part.flag(1)? {
            Arc::turn(&mut arcs);
        }
        let first = pieces.len();
        pieces.extend(arcs.iter().flat_map(|arc| arc.curve.bezier_segments()).map(|piece| piece.points));
        if pieces.len() > MOST_PIECES {
            return Err(entity.fault(format!("has more than the {MOST_PIECES} pieces that are read")));
        }
        if let (Some(before), Some(next)) = (first.checked_sub(1), pieces.get(first)) {
            let gap = gap(&pieces[before], next);
            let limit = units.tolerance_of(&pieces[before]).max(units.tolerance_of(next));
            if gap > limit {
                return Err(segment.fault(format!("begins {gap:.3e} from where the one before it ends")));
            }
        }
    }
    if pieces.is_empty() {
        return Err(entity.fault("has no segments"));
    }
    joined(&pieces).map(Some).map_err(|e| entity.fault(e.to_string()))
}

/// Distance from the end of a piece to the beginning of the next.
fn gap(piece: &[DVec4], next: &[DVec4]) -> f64 {
    match (piece.last(), next.first()) {
        (Some(a), Some(b)) => (a.truncate() / a.w).distance(b.truncate() / b.w),
        _ => f64::INFINITY,
    }
}

/// Bézier curves, by their homogeneous control points, as one B-spline curve.
fn joined(pieces: &[Vec<DVec4>]) -> Result<Curve, NurbsError> {
    let degree = pieces.iter().map(|points| points.len() - 1).max().unwrap_or(1);
    let (mut knots, mut all) = (vec![0.0; degree + 1], Vec::<DVec4>::new());
    for (k, points) in pieces.iter().enumerate() {
        let bezier = KnotVector::bezier(points.len() - 1, [0.0, 1.0])?;
        let points = Curve::from_homogeneous(bezier, points.clone())?.elevated(degree)?.homogeneous().to_vec();
        match all.last().copied() {
            // The weights of a piece have a factor in common that says nothing: one that makes it go on as the last one ends.
            Some(end) => all.extend(points[1..].iter().map(|h| *h * (end.w / points[0].w))),
            None => all.extend(points),
        }
        knots.extend(vec![k as f64 + 1.0; degree]);
    }
    knots.push(pieces.len() as f64);
    Curve::from_homogeneous(KnotVector::new(knots, degree)?, all)
}
