//! The records as they lie in the bytes. Numbers are raw, in the order of the bytes of the chips; everything is borrowed, so that
//! reading takes no memory but for what is made of it, and no length in the bytes can ask for more than they hold.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};
use penvis_core::extract::CurveSet;
use penvis_core::nurbs::{KnotVector, NurbsError, Surface};
use penvis_core::stroke::CurveKind;
use penvis_core::trim::{TrimError, TrimPiece, Trims};
use serde::{Deserialize, Serialize};

/// What comes first.
#[derive(Serialize, Deserialize)]
pub(super) struct HeadRecord<'a> {
    pub(super) name: &'a str,
    pub(super) perspective: bool,
    /// Direction to the eye, or the eye; the target; up.
    pub(super) sight: [[f64; 3]; 3],
    pub(super) deepest: u32,
    pub(super) propagate: bool,
    pub(super) clusters: bool,
    pub(super) smooth_angle: f64,
    pub(super) tolerance: f64,
    pub(super) map: [[f64; 3]; 2],
    pub(super) draw_feed: f64,
    /// Lines, each ended by a line feed: start, pen down, pen up, end.
    #[serde(borrow)]
    pub(super) lines: [&'a str; 4],
    /// Lines for each pen.
    #[serde(borrow)]
    pub(super) changes: Vec<(u32, &'a str)>,
    pub(super) surfaces: u32,
}

/// A surface.
#[derive(Serialize, Deserialize)]
pub(super) struct SurfaceRecord<'a> {
    pub(super) name: &'a str,
    /// Bits of the kinds of curve, in the order of [`KINDS`].
    pub(super) curves: u8,
    pub(super) isos: u32,
    pub(super) pen: u32,
    pub(super) hidden: Option<u32>,
    pub(super) crease_angle: Option<f64>,
    pub(super) degrees: [u8; 2],
    pub(super) knots: [&'a [u8]; 2],
    /// (x·w, y·w, z·w) of the control points.
    pub(super) points: &'a [u8],
    /// The weights, none if all are 1.
    pub(super) weights: &'a [u8],
    /// Loops of its trims, which follow; none if all of it is kept.
    pub(super) loops: Option<u32>,
}

/// A piece of a trim loop. A loop is their number, and then so many of them; the last ends where the first begins.
#[derive(Serialize, Deserialize)]
pub(super) struct PieceRecord<'a> {
    pub(super) from: [f64; 2],
    /// (u·w, v·w, w) of the control points.
    pub(super) points: &'a [u8],
    pub(super) left: Option<bool>,
    pub(super) edge: Option<u32>,
}

/// Kinds of curve by their bits.
const KINDS: [CurveKind; 6] = [
    CurveKind::Boundary,
    CurveKind::Crease,
    CurveKind::Silhouette,
    CurveKind::Iso,
    CurveKind::Smooth,
    CurveKind::Section,
];

pub(super) fn curve_bits(curves: CurveSet) -> u8 {
    KINDS.iter().enumerate().filter(|(_, kind)| curves.contains(**kind)).fold(0, |bits, (k, _)| bits | 1 << k)
}

/// `None` for bits that stand for no kind.
pub(super) fn curve_set(bits: u8) -> Option<CurveSet> {
    let mut set = CurveSet::NONE;
    KINDS.iter().enumerate().filter(|(k, _)| bits & 1 << k != 0).for_each(|(_, kind)| set.insert(*kind));
    (bits >> KINDS.len() == 0).then_some(set)
}

/// Numbers as raw bytes.
pub(super) fn raw(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

/// Groups of N numbers from raw bytes; `None` if the bytes are not so many.
fn groups<const N: usize>(bytes: &[u8]) -> Option<impl ExactSizeIterator<Item = [f64; N]>> {
    let chunks = bytes.chunks_exact(8 * N);
    let number = |chunk: &[u8], k: usize| chunk.get(8 * k..).and_then(|b| b.first_chunk()).copied().unwrap_or_default();
    chunks
        .remainder()
        .is_empty()
        .then(|| chunks.map(move |chunk| core::array::from_fn(|k| f64::from_le_bytes(number(chunk, k)))))
}

/// The knots of a direction.
pub(super) fn knots(bytes: &[u8], degree: u8) -> Option<Result<KnotVector, NurbsError>> {
    let knots = groups(bytes)?.map(|[t]| t).collect();
    Some(KnotVector::new(knots, usize::from(degree)))
}

/// The surface of a record; `None` if bytes are not whole numbers, or weights not as many as points.
pub(super) fn surface(record: &SurfaceRecord<'_>) -> Option<Result<Surface, NurbsError>> {
    let [u, v] = [0, 1].map(|k| knots(record.knots[k], record.degrees[k]));
    let (positions, mut weights) = (groups(record.points)?, groups(record.weights)?);
    let common = weights.len() == 0;
    if !common && weights.len() != positions.len() {
        return None;
    }
    let mut points = Vec::with_capacity(positions.len());
    for [x, y, z] in positions {
        let w = if common { 1.0 } else { weights.next().map_or(1.0, |[w]| w) };
        points.push(DVec4::new(x, y, z, w));
    }
    let (u, v) = match (u?, v?) {
        (Ok(u), Ok(v)) => (u, v),
        (Err(error), _) | (_, Err(error)) => return Some(Err(error)),
    };
    Some(Surface::from_homogeneous(u, v, points))
}

/// Loops of trims, taken from the beginning of `bytes`; with what is left of them.
#[allow(clippy::type_complexity, reason = "loops of pieces, and the rest")]
pub(super) fn trims<'a>(
    surface: &Surface,
    loops: u32,
    mut bytes: &'a [u8],
) -> Option<(Result<Trims, TrimError>, &'a [u8])> {
    let mut all = Vec::new();
    for _ in 0..loops {
        let (count, rest) = postcard::take_from_bytes::<u32>(bytes).ok()?;
        bytes = rest;
        let mut records = Vec::new();
        for _ in 0..count {
            let (record, rest) = postcard::take_from_bytes::<PieceRecord<'_>>(bytes).ok()?;
            bytes = rest;
            records.push(record);
        }
        let mut pieces = Vec::with_capacity(records.len());
        for (k, record) in records.iter().enumerate() {
            let to = records.get(k + 1).or(records.first()).map_or(record.from, |next| next.from);
            let points = groups(record.points)?.map(DVec3::from_array).collect();
            let ends = [record.from, to].map(DVec2::from_array);
            pieces.push(TrimPiece::restored(points, ends, record.left, record.edge)?);
        }
        all.push(pieces);
    }
    Some((Trims::restored(surface, all), bytes))
}
