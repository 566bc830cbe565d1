//! Where two arcs meet on the screen: strips, cone test, Newton, and subdivision between them (Elber and Cohen 1989, §4).

use alloc::vec::Vec;

use glam::DVec2;

use super::PROBES;
use super::alongside::alongside;
use super::arc::{Arc, Strip};
use super::meeting::Meeting;

/// Work done by intersecting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Work {
    pub(crate) subdivisions: u64,
    pub(crate) newton: u64,
    /// Pairs given up because their subdivision came to no end.
    pub(crate) undecided: u64,
}

/// How far a crossing's Bézier parameter may lie outside [0, 1]: neighbouring arcs share their ends to rounding, so a
/// crossing at a joint is found from both and merged, never lost.
const END_SLACK: f64 = 1e-7;

/// Finds every meeting of `first` and `second`; those nearer together than `resolution` (screen units) are one.
pub(crate) fn meetings(first: &Arc, second: &Arc, resolution: f64, out: &mut Vec<Meeting>, work: &mut Work) {
    let (sa, sb) = (first.strip().wider(resolution), second.strip().wider(resolution));
    if sa.excludes(second) || sb.excludes(first) {
        return;
    }
    let limit = resolution + first.error + second.error;
    if (!sa.cones_apart(&sb) || sa.divergence(&sb) <= limit)
        && let Some(whole) = coincidence((first, &sa), (second, &sb), limit)
    {
        out.push(whole);
        return;
    }
    let before = work.subdivisions;
    recurse(first, second, resolution, out, work, (0, before + MOST_SUBDIVISIONS));
    work.undecided += u64::from(work.subdivisions >= before + MOST_SUBDIVISIONS);
}

/// The interval over which two arcs run within `limit` of each other, if they do from an end of one of them to another
/// end. Analytic curves coincide along all of what they have in common or at isolated points only, so this spares the
/// subdivision, which would cut coincident arcs until each part is straight to the limit.
fn coincidence((a, sa): (&Arc, &Strip), (b, sb): (&Arc, &Strip), limit: f64) -> Option<Meeting> {
    let ((a0, a1), (b0, b1)) = (a.ends(), b.ends());
    // The parameter on an arc of an end of the other one, if it lies on the arc.
    let on = |arc: &Arc, strip: &Strip, p: DVec2| {
        let height = (p - strip.origin).dot(strip.dir.perp());
        let margin = DVec2::splat(limit);
        let inside = p.cmpge(arc.lo - margin).all() && p.cmple(arc.hi + margin).all();
        if !inside || height < strip.lo - limit || height > strip.hi + limit {
            return None;
        }
        let (x, distance) = nearest(arc, p);
        (distance <= limit).then_some(x)
    };
    let common = [
        on(b, sb, a0).map(|y| (0.0, y)),
        on(b, sb, a1).map(|y| (1.0, y)),
        on(a, sa, b0).map(|x| (x, 0.0)),
        on(a, sa, b1).map(|x| (x, 1.0)),
    ];
    let places = || common.iter().flatten();
    let from = places().min_by(|p, q| p.0.total_cmp(&q.0))?;
    let to = places().max_by(|p, q| p.0.total_cmp(&q.0))?;
    let (p, q) = (a.jet(from.0).0, a.jet(to.0).0);
    // Arcs that share an end, or touch there, have a point in common, not an interval.
    if (q - p).truncate().length() <= 4.0 * limit {
        return None;
    }
    let beside = |f: &f64| nearest(b, a.jet(from.0 + f * (to.0 - from.0)).0.truncate()).1 <= limit;
    if !PROBES.iter().all(beside) {
        return None;
    }
    let middle = 0.5 * (from.0 + to.0);
    let on_a = a.jet(middle).0;
    let on_b = b.jet(nearest(b, on_a.truncate()).0).0;
    Some(Meeting::Overlap {
        a: [a.param(from.0), a.param(to.0)],
        b: [b.param(from.1), b.param(to.1)],
        za: on_a.z,
        zb: on_b.z,
    })
}

/// Steps of the search for the nearest point. A few are enough but where the arc stands still, which it does at the end that
/// runs along the sight line: there each step halves what is left.
const MOST_STEPS: u32 = 50;

/// Bézier parameter of the point of an arc nearest to `p` on the screen, and its distance: Gauss–Newton from the foot on
/// the chord, good for arcs whose tangents stay within a right angle of their chord.
pub(crate) fn nearest(arc: &Arc, p: DVec2) -> (f64, f64) {
    let (a, b) = arc.ends();
    let chord = b - a;
    let squared = chord.length_squared();
    let mut x = if squared > 0.0 { ((p - a).dot(chord) / squared).clamp(0.0, 1.0) } else { 0.5 };
    for _ in 0..MOST_STEPS {
        let (q, d) = arc.jet(x);
        let slope = d.truncate().length_squared();
        if slope == 0.0 {
            break;
        }
        let next = (x - (q.truncate() - p).dot(d.truncate()) / slope).clamp(0.0, 1.0);
        let moved = (next - x).abs();
        x = next;
        if moved <= 1e-14 {
            break;
        }
    }
    (x, (arc.jet(x).0.truncate() - p).length())
}

/// Each level halves one arc; 2⁻⁵⁰ of any arc is below the resolution of its coordinates.
const MAX_DEPTH: u32 = 100;

/// Halvings of one pair of arcs at the most. Two arcs of a drawing need some ten; only weights of many orders of magnitude,
/// whose control points say nothing of the curve, need more than this.
const MOST_SUBDIVISIONS: u64 = 4096;

/// Levels that strips have to themselves: two halvings part most arcs at a fraction of what it costs to compare two
/// that run along each other.
const STRIPS_FIRST: u32 = 2;

/// Widest strips, by the length of the shorter one, that are compared as running along each other: subdivision parts wider
/// ones at less cost.
const SLENDER: f64 = 0.1;

/// `limits` are the level and the count of subdivisions at which to give up.
fn recurse(a: &Arc, b: &Arc, resolution: f64, out: &mut Vec<Meeting>, work: &mut Work, limits: (u32, u64)) {
    let (depth, most) = limits;
    if work.subdivisions >= most {
        return;
    }
    let slack = DVec2::splat(resolution);
    if (a.lo - slack).cmpgt(b.hi).any() || (b.lo - slack).cmpgt(a.hi).any() {
        return;
    }
    let (sa, sb) = (a.strip().wider(resolution), b.strip().wider(resolution));
    if sa.excludes(b) || sb.excludes(a) {
        return;
    }
    let limit = 3.0 * resolution + 2.0 * (a.error + b.error);
    let straight = sa.width().max(sb.width()) <= limit;
    if sa.cones_apart(&sb) {
        // Arcs that are straight to the limit cross where their chords do, or not at all; an end may be short of the
        // other arc by the limit. Without this end to the subdivision two arcs that touch would be cut into as many
        // parts as their contact is resolutions long.
        let short = |s: &Strip| if s.length > 0.0 { limit / s.length } else { 1.0 };
        let slack = if straight { END_SLACK + short(&sa).max(short(&sb)).min(0.5) } else { END_SLACK };
        let start = |along: f64, s: &Strip| if s.length > 0.0 { (along / s.length).clamp(0.0, 1.0) } else { 0.5 };
        let found = chords_cross(&sa, &sb).and_then(|[along_a, along_b]| {
            let found = newton(a, b, [start(along_a, &sa), start(along_b, &sb)], slack, work);
            // Arcs that move apart by no more than the limit run along one another, and change sides as rounding will have it.
            if straight && sa.divergence(&sb) > limit {
                found.or_else(|| straight_crossing((a, &sa), (b, &sb), slack, limit, work))
            } else {
                found
            }
        });
        if straight || found.is_some() || depth >= MAX_DEPTH {
            out.extend(found);
            return;
        }
    } else if depth >= STRIPS_FIRST
        && sa.width().max(sb.width()) <= SLENDER * sa.length.min(sb.length)
        && alongside(a, b, resolution + a.error + b.error, out)
    {
        return;
    } else if straight && (beside(&sa, b, limit) || beside(&sb, a, limit)) || depth >= MAX_DEPTH {
        out.extend(overlap(a, b, &sa, &sb));
        return;
    }
    work.subdivisions += 1;
    let size = |arc: &Arc| (arc.hi - arc.lo).length_squared();
    if size(a) >= size(b) {
        let (l, r) = a.halves();
        recurse(&l, b, resolution, out, work, (depth + 1, most));
        recurse(&r, b, resolution, out, work, (depth + 1, most));
    } else {
        let (l, r) = b.halves();
        recurse(a, &l, resolution, out, work, (depth + 1, most));
        recurse(a, &r, resolution, out, work, (depth + 1, most));
    }
}

fn crossing(a: &Arc, x: f64, b: &Arc, y: f64) -> Meeting {
    let (pa, pb) = (a.jet(x).0, b.jet(y).0);
    Meeting::Crossing { a: a.param(x), b: b.param(y), za: pa.z, zb: pb.z }
}

/// Whether both ends of `arc` lie within `limit` of the strip's chord line.
fn beside(s: &Strip, arc: &Arc, limit: f64) -> bool {
    let off = |p: DVec2| (p - s.origin).dot(s.dir.perp()).abs();
    let (p, q) = arc.ends();
    off(p).max(off(q)) <= limit
}

/// Newton's method has settled when its last step is no longer than this; the next one would be its square.
const SETTLED: f64 = 1e-8;

/// Where the lines through the chords cross: distances along them from their beginnings; none if they are parallel.
fn chords_cross(sa: &Strip, sb: &Strip) -> Option<[f64; 2]> {
    let det = sa.dir.perp_dot(sb.dir);
    let gap = sb.origin - sa.origin;
    (det != 0.0).then(|| [gap.perp_dot(sb.dir) / det, gap.perp_dot(sa.dir) / det])
}

/// The crossing of two arcs that are straight to `limit` and of different directions, when Newton's method finds none from
/// parameters that are as far along as the crossing of the chords: weights, or control points, may make a straight arc run
/// so unevenly that it steps out of them, or stand still where it ends.
///
/// Being at an angle all along, they cross where the one changes sides of the other, or touch at its end; that their chords
/// cross nearby says nothing of arcs that are nearly parallel.
fn straight_crossing(
    (a, sa): (&Arc, &Strip),
    (b, sb): (&Arc, &Strip),
    slack: f64,
    limit: f64,
    work: &mut Work,
) -> Option<Meeting> {
    let along = |p: DVec2| (p - sb.origin).dot(sb.dir);
    let height = |x: f64| {
        let p = a.jet(x).0.truncate();
        (p - b.jet(reaches(b, sb, along(p))).0.truncate()).dot(sb.dir.perp())
    };
    let ends = [height(0.0), height(1.0)];
    let x = if ends[0] * ends[1] < 0.0 {
        let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
        for _ in 0..HALVINGS {
            let m = 0.5 * (lo + hi);
            if height(m) * ends[0] > 0.0 { lo = m } else { hi = m }
        }
        0.5 * (lo + hi)
    } else {
        let end = usize::from(ends[1].abs() < ends[0].abs());
        // As far from the other arc as it goes on beyond an end that is short of it by the limit.
        let touches = ends[end].abs() <= limit * sa.dir.perp_dot(sb.dir).abs();
        touches.then_some(end as f64)?
    };
    let at = along(a.jet(x).0.truncate());
    if !(-limit..=sb.length + limit).contains(&at) {
        return None;
    }
    let y = reaches(b, sb, at);
    newton(a, b, [x, y], slack, work).or_else(|| Some(crossing(a, x, b, y)))
}

/// Halvings that leave a few roundings of a parameter.
const HALVINGS: u32 = 50;

/// The Bézier parameter at which a nearly straight arc, which may run unevenly, is `along` its chord.
fn reaches(arc: &Arc, s: &Strip, along: f64) -> f64 {
    if s.length <= 0.0 {
        return 0.5;
    }
    let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
    for _ in 0..HALVINGS {
        let m = 0.5 * (lo + hi);
        if (arc.jet(m).0.truncate() - s.origin).dot(s.dir) < along { lo = m } else { hi = m }
    }
    0.5 * (lo + hi)
}

/// Newton's method from two parameters. `None` if it leaves the arcs by more than `slack` of their parameter, or does not
/// settle.
fn newton(a: &Arc, b: &Arc, [mut x, mut y]: [f64; 2], slack: f64, work: &mut Work) -> Option<Meeting> {
    let mut step = f64::INFINITY;
    for _ in 0..12 {
        work.newton += 1;
        let ((pa, da), (pb, db)) = (a.jet(x), b.jet(y));
        let r = (pb - pa).truncate();
        let (da, db) = (da.truncate(), db.truncate());
        let det = da.perp_dot(db);
        if det == 0.0 {
            return None;
        }
        let (dx, dy) = (r.perp_dot(db) / det, r.perp_dot(da) / det);
        x += dx;
        y += dy;
        // One arc's neighbourhood is enough; beyond it the Bézier curve is an extrapolation.
        if !(-1.0..=2.0).contains(&x) || !(-1.0..=2.0).contains(&y) {
            return None;
        }
        step = dx.abs().max(dy.abs());
        if step <= 1e-13 {
            break;
        }
    }
    // Steps become no smaller than rounding makes them, the more so the smaller the angle between the arcs.
    if step > SETTLED {
        return None;
    }
    let inside = -slack..=1.0 + slack;
    if !(inside.contains(&x) && inside.contains(&y)) {
        return None;
    }
    Some(crossing(a, x.clamp(0.0, 1.0), b, y.clamp(0.0, 1.0)))
}

/// The interval in which two nearly parallel, nearly straight arcs run beside each other.
fn overlap(a: &Arc, b: &Arc, sa: &Strip, sb: &Strip) -> Option<Meeting> {
    let on = |s: &Strip, arc: &Arc| {
        let (p, q) = arc.ends();
        let (f, g) = ((p - s.origin).dot(s.dir), (q - s.origin).dot(s.dir));
        (f.min(g).max(0.0), f.max(g).min(s.length))
    };
    let (a0, a1) = on(sa, b);
    let (b0, b1) = on(sb, a);
    if a0 > a1 || b0 > b1 {
        return None;
    }
    let (x0, x1) = (reaches(a, sa, a0), reaches(a, sa, a1));
    let (y0, y1) = (reaches(b, sb, b0), reaches(b, sb, b1));
    let za = a.jet(0.5 * (x0 + x1)).0.z;
    let zb = b.jet(0.5 * (y0 + y1)).0.z;
    Some(Meeting::Overlap { a: [a.param(x0), a.param(x1)], b: [b.param(y0), b.param(y1)], za, zb })
}

#[cfg(test)]
mod tests {
    use super::super::arc::Control;
    use super::*;
    use glam::DVec4;
    use proptest::prelude::*;

    fn arc(points: &[[f64; 3]]) -> Arc {
        let points: Control = points.iter().map(|p| DVec4::new(p[0], p[1], p[2], 1.0)).collect();
        Arc::new(0, [0.0, 1.0], points, 0.0)
    }

    fn all(a: &Arc, b: &Arc) -> Vec<Meeting> {
        let mut out = Vec::new();
        meetings(a, b, 1e-9, &mut out, &mut Work::default());
        out
    }

    #[test]
    fn two_chords_cross_once_with_their_depths() {
        let m = all(&arc(&[[0.0, 0.0, 1.0], [1.0, 1.0, 3.0]]), &arc(&[[0.0, 1.0, 5.0], [1.0, 0.0, 5.0]]));
        assert_eq!(m.len(), 1);
        let Meeting::Crossing { a, b, za, zb } = m[0] else { panic!("{m:?}") };
        assert!((a - 0.5).abs() < 1e-12 && (b - 0.5).abs() < 1e-12 && (za - 2.0).abs() < 1e-12 && zb == 5.0);
    }

    /// Newton's method from the crossing of the chords runs to and fro between these two and never settles.
    #[test]
    fn a_crossing_lies_on_both_arcs() {
        let a = arc(&[
            [-0.11024687638050482, 2.3609034428583273, 1.3206517048301176],
            [-0.22049375276100963, 2.1532301967901675, 1.40642941078284],
            [-0.7166046964732814, 1.8270477000186716, 2.0848992451989483],
            [-0.7166046964732814, 1.6918594532330673, 2.01990587683698],
        ]);
        let b = arc(&[
            [-0.38460957905632925, 1.579746934136184, 2.253103436548229],
            [-0.7615269665315318, 1.626408135290863, 2.15604667312769],
            [-1.055753294509624, 1.732229073623796, 1.9359357989418244],
            [-1.2288276050849722, 1.8672132626784035, 1.655164447618122],
        ]);
        let found = all(&a, &b);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn straight_arcs_cross_however_unevenly_they_run() {
        for w in [1.0, 1.0 / 3.0, 0.05, 1.0 / 64.0, 1e-6, 20.0, 64.0, 1e6] {
            let points = [DVec4::new(0.0, 0.0, 0.0, 1.0), DVec4::new(w, 0.0, 0.0, w)];
            let weighted = Arc::new(0, [0.0, 1.0], points.into_iter().collect(), 0.0);
            let crowded = arc(&[[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
            for at in [0.0, 1e-3, 0.04, 0.3, 0.6, 0.98, 1.0] {
                for uneven in [&weighted, &crowded] {
                    let across = arc(&[[at - 0.3, -0.1, 1.0], [at + 0.6, 0.2, 1.0]]);
                    for (m, is_first) in [(all(uneven, &across), true), (all(&across, uneven), false)] {
                        assert_eq!(m.len(), 1, "weight {w}, at {at}");
                        let Meeting::Crossing { a, b, .. } = m[0] else { panic!("{m:?}") };
                        let x = uneven.jet(if is_first { a } else { b }).0.x;
                        assert!((x - at).abs() < 1e-9, "weight {w}: {x} instead of {at}");
                    }
                }
            }
        }
    }

    proptest! {
        #[test]
        fn crossings_lie_on_both_arcs_and_none_is_missed(
            coordinates in proptest::array::uniform16(-1.0..1.0_f64), bow in 0.0..0.5_f64
        ) {
            // Cubics of every shape, from straight ones to loops.
            let points = |k: usize| -> Vec<[f64; 3]> {
                let c = |i: usize| DVec2::new(coordinates[8 * k + 2 * i], coordinates[8 * k + 2 * i + 1]);
                let (p, q) = (c(0), c(1));
                let inner = |f: f64, i: usize| p.lerp(q, f) + bow * c(i);
                [p, inner(1.0 / 3.0, 2), inner(2.0 / 3.0, 3), q].map(|p| [p.x, p.y, 0.0]).to_vec()
            };
            let (a, b) = (arc(&points(0)), arc(&points(1)));
            let found = all(&a, &b);
            for m in &found {
                if let Meeting::Crossing { a: x, b: y, .. } = m {
                    let apart = (a.jet(*x).0 - b.jet(*y).0).length();
                    prop_assert!(apart < 1e-8, "{m:?} {apart}");
                }
            }
            // Chords of both that clearly cross stand for a crossing of the arcs, whose curvature is small beside them.
            const N: usize = 400;
            let at = |arc: &Arc, k: usize| arc.jet(k as f64 / N as f64).0.truncate();
            for i in 0..N {
                let (p, q) = (at(&a, i), at(&a, i + 1));
                for j in 0..N {
                    let (r, s) = (at(&b, j), at(&b, j + 1));
                    let det = (q - p).perp_dot(s - r);
                    let (x, y) = ((r - p).perp_dot(s - r) / det, (r - p).perp_dot(q - p) / det);
                    let steep = det.abs() > 0.1 * (q - p).length() * (s - r).length();
                    if steep && (0.2..0.8).contains(&x) && (0.2..0.8).contains(&y) {
                        let t = (i as f64 + x) / N as f64;
                        let near = found.iter().any(|m| match m {
                            Meeting::Crossing { a, .. } => (a - t).abs() < 2.0 / N as f64,
                            Meeting::Overlap { a, .. } => a[0] - 2.0 / N as f64 <= t && t <= a[1] + 2.0 / N as f64,
                        });
                        prop_assert!(near, "at {t}: {found:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_parabola_meets_a_line_twice_once_or_not() {
        let parabola = arc(&[[-1.0, 1.0, 0.0], [0.0, -1.0, 0.0], [1.0, 1.0, 0.0]]); // y = x²
        let line = |y: f64| arc(&[[-2.0, y, 0.0], [2.0, y, 0.0]]);
        // At a joint of the subdivision a crossing is found from both sides: the caller merges them.
        let mut two: Vec<f64> = all(&parabola, &line(0.25))
            .iter()
            .map(|m| if let Meeting::Crossing { a, .. } = m { *a } else { panic!("{m:?}") })
            .collect();
        two.dedup_by(|x, y| (*x - *y).abs() < 1e-12);
        assert_eq!(two.len(), 2, "{two:?}");
        assert!((two[0] - 0.25).abs() < 1e-12 && (two[1] - 0.75).abs() < 1e-12);
        assert!(all(&parabola, &line(-0.01)).is_empty());
        // The tangent at x = −0.4, which is t = 0.3.
        let touch = all(&parabola, &arc(&[[-2.0, 1.44, 0.0], [2.0, -1.76, 0.0]]));
        assert!(!touch.is_empty());
        for m in touch {
            let Meeting::Overlap { a, .. } = m else { panic!("{m:?}") };
            assert!((a[0] - 0.3).abs() < 1e-3 && (a[1] - 0.3).abs() < 1e-3);
        }
        // The tangent at the vertex touches halves of the parabola in their common end.
        let end = all(&parabola, &line(0.0));
        assert!(!end.is_empty());
        for m in end {
            let (Meeting::Crossing { a, .. } | Meeting::Overlap { a: [a, _], .. }) = m;
            assert!((a - 0.5).abs() < 1e-3, "{m:?}");
        }
    }

    #[test]
    fn coincident_curved_arcs_are_seen_without_subdivision() {
        // A parabola, and the part of it between 0.3 and 1 run backwards.
        let whole = arc(&[[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [2.0, 0.0, 0.0]]);
        let part = arc(&[[2.0, 0.0, 1.0], [1.3, 1.4, 1.0], [0.6, 0.84, 1.0]]);
        let (mut out, mut work) = (Vec::new(), Work::default());
        meetings(&whole, &part, 1e-9, &mut out, &mut work);
        assert_eq!(out.len(), 1);
        assert_eq!(work.subdivisions, 0);
        let Meeting::Overlap { a, za, zb, .. } = out[0] else { panic!("{out:?}") };
        assert!((a[0] - 0.3).abs() < 1e-9 && (a[1] - 1.0).abs() < 1e-9 && za < zb);
    }

    #[test]
    fn coincident_arcs_give_one_interval_not_a_cloud() {
        let long = arc(&[[0.0, 0.0, 1.0], [4.0, 0.0, 1.0]]);
        let short = arc(&[[3.0, 0.0, 2.0], [1.0, 0.0, 2.0]]);
        let m = all(&long, &short);
        assert_eq!(m.len(), 1);
        let Meeting::Overlap { a, za, zb, .. } = m[0] else { panic!("{m:?}") };
        assert!((a[0] - 0.25).abs() < 1e-9 && (a[1] - 0.75).abs() < 1e-9 && za < zb);
    }
}
