//! Pieces that are seen, though they were left out for another curve on the same line, because that curve is hidden.
//!
//! Of curves that coincide on the screen one is drawn: the nearest, or of those at one depth the first. The nearest is hidden only
//! where the others are. But where two leave one corner side by side, the one on a surface, the other into it, they are at one
//! depth to begin with, and the first may be the one that is hidden.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::BorderOptions;
use super::planar::nearest;
use super::sides::SAG;
use crate::stroke::{from_chord, places, runs};
use crate::visibility::{ClassifyOptions, RayScratch, Sighting, Subject, VisibilityStats, classify_one};

/// What is visible, in the order of the curves and their parameters: of the sightings, and of pieces that are covered where no visible
/// curve draws them, which sight lines are asked for. Also the number of sight lines.
pub(super) fn visible(
    subject: &Subject<'_>,
    sightings: &[Sighting],
    asking: &ClassifyOptions,
    options: &BorderOptions<'_>,
) -> (Vec<Sighting>, u64) {
    let mut out: Vec<Sighting> = sightings.iter().filter(|s| s.qi == 0).cloned().collect();
    let mut drawn = Drawn { subject, visible: runs(&out), options, places: BTreeMap::new() };
    let (mut scratch, mut stats) = (RayScratch::default(), VisibilityStats::default());
    for piece in subject.arrangement.pieces.iter().filter(|p| subject.curves[p.curve].inked) {
        if subject.stop.is_wanted() {
            break;
        }
        let (Some(by), curve) = (piece.covered_by, &subject.curves[piece.curve]) else { continue };
        let lengths = &subject.arrangement.lengths[piece.curve];
        let middle = lengths.param_at(0.5 * (lengths.length_at(piece.t[0]) + lengths.length_at(piece.t[1])));
        if drawn.holds(by, curve.point(&subject.geometry, middle).truncate()) {
            continue;
        }
        let own = (piece.curve, curve, lengths);
        let seen = classify_one(subject.surroundings(), asking, own, &[piece.t], &mut scratch, &mut stats);
        out.extend(seen.into_iter().filter(|s| s.qi == 0));
    }
    out.sort_by(|a, b| a.curve.cmp(&b.curve).then(a.t[0].total_cmp(&b.t[0])));
    (out, scratch.stats.rays)
}

/// Parameters and positions along a visible part.
type Places = Vec<(f64, DVec3)>;

/// The visible parts of curves that cover others, as chords.
struct Drawn<'a> {
    subject: &'a Subject<'a>,
    visible: Vec<Sighting>,
    options: &'a BorderOptions<'a>,
    places: BTreeMap<usize, Vec<Places>>,
}

impl Drawn<'_> {
    /// Whether a visible part of a curve goes through a place.
    fn holds(&mut self, curve: usize, q: DVec2) -> bool {
        let Self { subject, visible, options, places: all } = self;
        let BorderOptions { tolerance, contact, .. } = **options;
        let (g, path) = (&subject.geometry, &subject.curves[curve]);
        let parts = all.entry(curve).or_insert_with(|| {
            let from = visible.partition_point(|s| s.curve < curve);
            let own = visible[from..].iter().take_while(|s| s.curve == curve);
            own.map(|s| places(g, path, s.t, tolerance)).collect()
        });
        parts.iter().flat_map(|p| p.windows(2)).any(|w| {
            let [a, b] = [w[0].1, w[1].1].map(|p| p.truncate().extend(0.0));
            from_chord(q.extend(0.0), a, b) <= SAG * tolerance + contact
                && nearest(|t| path.point(g, t).truncate(), q, [w[0].0, w[1].0], 0.0).1 <= contact
        })
    }
}
