//! What the visibility of one piece says of another: links.
//!
//! A link from piece a to piece b with the difference d states that the quantitative invisibility of b is that of a plus
//! d. It holds by what the two have in common, and nothing else of the scene:
//!
//! - **Next and Prev** (corollary 5.1, rules 2, 3 and 5 of Elber and Cohen 1989; the ΔQI of Heger and Appel): two pieces
//!   of one curve, parted by active curves nearer to the eye. Each of them has sheets on its left and on its right on
//!   the screen; passing from one side to the other takes away the ones and adds the others: ±2 over a fold, ±1 over a
//!   free boundary, 0 over a crease with a sheet on either side.
//! - **Own fold**: an isoparametric line passes the silhouette of its own surface. Of the two sheets of the fold it
//!   leaves one for the other, and the nearer one hides the other: ±1.
//! - **Touching** (rules 1 and 4): two pieces that meet in one point of space see the same sheets before it, but for those
//!   that end in that point. Lines of one surface that cross have the same invisibility. Where a line ends at an edge,
//!   it is hidden by every other sheet of the edge that lies on its side of the edge on the screen and is nearer there
//!   (the wedge test).
//! - **Silhouettes** go on over a smooth border of patches. At a cusp the branch that is farther has one sheet more in
//!   front (the third sheet of the fold, which the nearer branch has behind it).
//!
//! Heger's half and quarter invisibilities stand for what is seen exactly along an edge or a vertex. There is no need of
//! them here: pieces are open intervals, an end that lies in another curve's end is no link, and where a rule's condition
//! is near its limit (a tangent crossing, a sheet seen edge-on, curves that coincide, a corner where several edges
//! meet) no link is made, so that a ray decides. Nor is any made to or over a curve of a trimmed surface.

use alloc::borrow::Cow;
use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::classify::Subject;
use crate::arrange::{Cut, Piece};
use crate::extract::silhouette::{CurveEnd, TracedCurve};
use crate::extract::zero_set::Variable;
use crate::extract::{CurveKind, Path, SurfaceCurve, lies_left, lies_left_along};
use crate::line::{Axis, Line};
use crate::stitch::EdgeClass;

/// QI of the piece `to` is that of the piece `from` plus `difference`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Link {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) difference: i32,
}

/// Sines and relative slopes below this are too near 0 for a rule that asks for their sign.
const FLAT: f64 = 1e-4;

/// Crossings with one curve nearer together than this part of a margin are one, found twice.
const SAME: f64 = 1e-2;

/// A sheet that ends at an edge, by its line there.
struct Sheet<'a> {
    line: Cow<'a, Line>,
    /// The line is the curve's own path.
    own: bool,
}

/// A sheet beside a point of an edge.
#[derive(Clone, Copy)]
struct Beside {
    /// 1 on the left of the edge on the screen, −1 on the right.
    side: i32,
    /// Depth gained from the edge into the sheet, by distance on the screen across the edge.
    rise: f64,
}

pub(super) struct Linker<'a> {
    subject: &'a Subject<'a>,
    /// For each curve its first piece; one more at the end.
    starts: Vec<usize>,
    /// For each curve that is an edge, the sheets that meet in it.
    sheets: Vec<Vec<Sheet<'a>>>,
    /// For each side the curves along it.
    along: Vec<Vec<usize>>,
    /// For each curve whether a surface that it lies on is trimmed.
    trimmed: Vec<bool>,
    /// For each surface those that share an edge with it, and itself.
    joined: Vec<Vec<usize>>,
    /// For each surface the edges inside it.
    inner: Vec<Vec<usize>>,
    /// Length on the screen: what is nearer than this to an end of a piece is not clearly inside.
    margin: f64,
    links: Vec<Link>,
}

/// All links among the pieces of an arrangement. `margin` is a length on the screen, some resolutions of the arrangement.
/// Cost: a few evaluations a piece and a pair of crossing lines.
pub(super) fn links(subject: &Subject<'_>, margin: f64) -> Vec<Link> {
    let pieces = &subject.arrangement.pieces;
    let starts = (0..=subject.curves.len()).map(|c| pieces.partition_point(|p| p.curve < c)).collect();
    let sheets = subject.curves.iter().map(|c| sheets(subject, c)).collect();
    let mut along = vec![Vec::new(); subject.stitching.sides.len()];
    let mut inner = vec![Vec::new(); subject.geometry.view.surfaces().len()];
    for (k, curve) in subject.curves.iter().enumerate() {
        for &side in &curve.sides {
            along[side].push(k);
        }
        if curve.active && curve.sides.is_empty() && matches!(curve.path, Path::Line(_)) {
            inner[curve.surface].push(k);
        }
    }
    let joined = subject.stitching.joined_surfaces();
    let is_trimmed = |c: &SurfaceCurve| c.surfaces.iter().any(|&s| subject.geometry.view.trims(s).is_some());
    let trimmed = subject.curves.iter().map(is_trimmed).collect();
    let mut linker = Linker { subject, starts, trimmed, joined, sheets, along, inner, margin, links: Vec::new() };
    linker.next_and_previous();
    linker.lines();
    linker.silhouettes();
    linker.links
}

fn sheets<'a>(subject: &Subject<'a>, curve: &'a SurfaceCurve) -> Vec<Sheet<'a>> {
    let Path::Line(path) = &curve.path else { return Vec::new() };
    if !curve.active {
        return Vec::new();
    }
    if curve.sides.is_empty() {
        // A knot line: the patches on its two sides.
        let other = Line::new(subject.geometry.view, path.surface, path.axis, path.value, !path.below);
        return vec![Sheet { line: Cow::Borrowed(path), own: true }, Sheet { line: Cow::Owned(other), own: false }];
    }
    let line = |&s: &usize| subject.stitching.sides[s].path.line();
    let sheet = |(k, l): (usize, &'a Line)| Sheet { line: Cow::Borrowed(l), own: k == 0 };
    // Where a trim curve is among them there are no links.
    let lines: Option<Vec<&Line>> = curve.sides.iter().map(line).collect();
    lines.unwrap_or_default().into_iter().enumerate().map(sheet).collect()
}

impl<'a> Linker<'a> {
    fn curve(&self, k: usize) -> &'a SurfaceCurve {
        &self.subject.curves[k]
    }

    fn link(&mut self, from: usize, to: usize, difference: i32) {
        self.links.push(Link { from, to, difference });
    }

    /// The piece of a curve that holds `t` clearly in its inside.
    fn inside(&self, curve: usize, t: f64) -> Option<usize> {
        if self.trimmed[curve] {
            return None;
        }
        let (first, last) = (self.starts[curve], self.starts[curve + 1]);
        let pieces = &self.subject.arrangement.pieces;
        let k = first + pieces[first..last].partition_point(|p| p.t[1] < t);
        let piece = pieces[..last].get(k).filter(|p| !p.coincident)?;
        let table = &self.subject.arrangement.lengths[curve];
        let l = table.length_at(t);
        let clear = l > table.length_at(piece.t[0]) + self.margin && l < table.length_at(piece.t[1]) - self.margin;
        clear.then_some(k)
    }

    /// The first or last piece of a curve, if it is longer than a margin and nothing crosses its end.
    fn at_end(&self, curve: usize, last: bool) -> Option<usize> {
        if self.trimmed[curve] {
            return None;
        }
        let range = self.starts[curve]..self.starts[curve + 1];
        let k = if last { range.clone().next_back() } else { range.clone().next() }?;
        let piece = &self.subject.arrangement.pieces[k];
        let table = &self.subject.arrangement.lengths[curve];
        let long = table.length_at(piece.t[1]) - table.length_at(piece.t[0]) > 2.0 * self.margin;
        (long && !piece.coincident && !piece.crossed[usize::from(last)]).then_some(k)
    }

    /// Links between neighbouring pieces of one curve.
    fn next_and_previous(&mut self) {
        let pieces = &self.subject.arrangement.pieces;
        for k in 1..pieces.len() {
            let (a, b) = (&pieces[k - 1], &pieces[k]);
            if a.curve != b.curve || !(self.is_plain(a) && self.is_plain(b)) {
                continue;
            }
            let cuts = self.told_apart(&b.entered);
            let change =
                |cuts: Vec<Cut>| cuts.iter().try_fold(0, |sum, cut| Some(sum + self.change(a.curve, b.t[0], cut)?));
            if let Some(difference) = cuts.and_then(change) {
                self.link(k - 1, k, difference);
            }
        }
    }

    /// Whether a piece is longer than a margin, runs along nothing, and is on no trimmed surface.
    fn is_plain(&self, piece: &Piece) -> bool {
        let table = &self.subject.arrangement.lengths[piece.curve];
        !self.trimmed[piece.curve]
            && !piece.coincident
            && table.length_at(piece.t[1]) - table.length_at(piece.t[0]) > self.margin
    }

    /// The cuts of one place, each once: what crosses at the joint of two arcs is found on both of them. None if one
    /// curve crosses more than once there.
    fn told_apart(&self, cuts: &[Cut]) -> Option<Vec<Cut>> {
        let mut kept: Vec<Cut> = Vec::with_capacity(cuts.len());
        for cut in cuts {
            let Cut::Crossing { with, at, .. } = *cut else {
                kept.push(*cut);
                continue;
            };
            let table = &self.subject.arrangement.lengths[with];
            let length = table.length_at(at);
            let gap = |other: &Cut| match *other {
                Cut::Crossing { with: w, at: s, .. } if w == with => Some((table.length_at(s) - length).abs()),
                _ => None,
            };
            match kept.iter().find_map(gap) {
                None => kept.push(*cut),
                Some(gap) if gap <= SAME * self.margin => {}
                Some(_) => return None,
            }
        }
        Some(kept)
    }

    /// What a cut at `t` adds to the invisibility of a curve, going on along it.
    fn change(&self, curve: usize, t: f64, cut: &Cut) -> Option<i32> {
        let g = &self.subject.geometry;
        match *cut {
            Cut::Crossing { with, at, nearer: true } => {
                // An end is where other curves begin, and something else may turn.
                let table = &self.subject.arrangement.lengths[with];
                let l = table.length_at(at);
                if l < self.margin || l > table.total() - self.margin {
                    return None;
                }
                if self.is_near_own_fold(curve, t, with) {
                    return None;
                }
                let along = self.curve(curve).jet(g, t).1.truncate().normalize_or_zero();
                let across = self.curve(with).jet(g, at).1.truncate().normalize_or_zero();
                let turn = across.perp_dot(along);
                let [left, right] = self.sides_covered(with, at)?;
                (turn.abs() > FLAT).then(|| if turn > 0.0 { left - right } else { right - left })
            }
            Cut::Own => self.own_fold(curve, t).map(|towards_eye| if towards_eye { -1 } else { 1 }),
            _ => None,
        }
    }

    /// Whether a curve crosses a silhouette of its own surface, or of one joined to that, so close to where it touches it that the two may still be
    /// one on the screen: a tangency of curvature 1/R stays within the margin m for √(8 m R).
    fn is_near_own_fold(&self, curve: usize, t: f64, with: usize) -> bool {
        let (c, other) = (self.curve(curve), self.curve(with));
        let joined = |s: &usize| c.surfaces.iter().any(|&own| self.joined[own].binary_search(s).is_ok());
        if other.kind != CurveKind::Silhouette || !other.surfaces.iter().any(joined) {
            return false;
        }
        let table = &self.subject.arrangement.lengths[curve];
        let reach = libm::sqrt(8.0 * self.margin * self.subject.geometry.view.size());
        let near = |s: &f64| (table.length_at(*s) - table.length_at(t)).abs() <= reach;
        c.splits.iter().chain(&c.domain).any(near)
    }

    /// How many sheets that end at an active curve lie on its left and on its right on the screen.
    fn sides_covered(&self, curve: usize, t: f64) -> Option<[i32; 2]> {
        let c = self.curve(curve);
        if self.trimmed[curve] {
            return None;
        }
        match &c.path {
            Path::Traced(traced) => {
                let left = fold_lies_left(self.subject, traced, c, t)?;
                Some(if left { [2, 0] } else { [0, 2] })
            }
            Path::Section(_) | Path::Trim(_) => None,
            Path::Line(_) => {
                if c.splits.iter().any(|&s| self.near(curve, s, t)) {
                    return None;
                }
                let mut covered = [0, 0];
                for sheet in &self.sheets[curve] {
                    match self.side(c, sheet, t)? {
                        (1, _) => covered[0] += 1,
                        (-1, _) => covered[1] += 1,
                        _ => {}
                    }
                }
                Some(covered)
            }
        }
    }

    fn near(&self, curve: usize, s: f64, t: f64) -> bool {
        let table = &self.subject.arrangement.lengths[curve];
        (table.length_at(s) - table.length_at(t)).abs() <= self.margin
    }

    /// On which side of an edge one of its sheets lies, and the parameter on the sheet's own line.
    fn side(&self, c: &SurfaceCurve, sheet: &Sheet<'_>, t: f64) -> Option<(i8, f64)> {
        let g = &self.subject.geometry;
        if sheet.own {
            return Some((lies_left(g, &sheet.line, t), t));
        }
        let (p, along) = c.jet(g, t);
        let (at, distance) = sheet.line.nearest(p);
        (distance <= self.subject.reach()).then(|| (lies_left_along(g, &sheet.line, at, along), at))
    }

    /// Whether an isoparametric line comes nearer to the eye where it passes over the fold of its own surface at `t`;
    /// none where it does not pass from one sheet of the fold to the other.
    fn own_fold(&self, curve: usize, t: f64) -> Option<bool> {
        let c = self.curve(curve);
        let Path::Line(line) = &c.path else { return None };
        if c.active || c.splits.iter().filter(|&&s| self.near(curve, s, t)).count() != 1 {
            return None;
        }
        let Fold { jets: [du, dv], gradient } = self.fold(line, t)?;
        let running = if line.axis == Axis::U { 1 } else { 0 };
        // The line must pass through F = 0, and the silhouette have a direction on the screen.
        if gradient[running].abs() <= FLAT * gradient.length() {
            return None;
        }
        let along = [du, dv][running];
        let silhouette = du * gradient.y - dv * gradient.x;
        let flat = silhouette.truncate();
        if flat.length() <= FLAT * silhouette.length() {
            return None;
        }
        // What of the line's direction is not the silhouette's lies along the sight line.
        let share = along.truncate().dot(flat) / flat.length_squared();
        let towards = along.z - share * silhouette.z;
        (towards.abs() > FLAT * along.length()).then_some(towards > 0.0)
    }

    /// Derivatives of the surface and of F at a place of a line.
    fn fold(&self, line: &Line, t: f64) -> Option<Fold> {
        let (patch, at) = line.place(t);
        let running = if line.axis == Axis::U { at.y } else { at.x };
        // On a border of patches it is not known on which of them the fold goes on.
        if !(FLAT..=1.0 - FLAT).contains(&running) {
            return None;
        }
        fold_at(self.subject, patch, at)
    }

    /// Links of isoparametric lines with one another and with the edges of their surfaces.
    fn lines(&mut self) {
        let count = self.subject.geometry.view.surfaces().len();
        let mut of_surface: Vec<[Vec<usize>; 2]> = vec![[Vec::new(), Vec::new()]; count];
        for (k, c) in self.subject.curves.iter().enumerate() {
            if let (Path::Line(line), false) = (&c.path, c.active || self.trimmed[k]) {
                of_surface[c.surface][usize::from(line.axis == Axis::V)].push(k);
            }
        }
        let mut ends: Vec<Vec<(f64, usize)>> = vec![Vec::new(); self.subject.stitching.sides.len()];
        for (surface, [us, vs]) in of_surface.iter().enumerate() {
            for &a in us {
                for &b in vs {
                    self.crossing_on_surface(a, b);
                }
            }
            for &k in us.iter().chain(vs) {
                self.knot_lines(k);
                for last in [false, true] {
                    let c = self.curve(k);
                    let Path::Line(line) = &c.path else { continue };
                    // Joins of smooth surfaces are lines as well, and parts of them end within the surface.
                    if c.domain[usize::from(last)] != line.domain()[usize::from(last)] {
                        continue;
                    }
                    let side = 4 * surface + if line.axis == Axis::U { 2 } else { 0 } + usize::from(last);
                    let Some(piece) = self.at_end(k, last) else { continue };
                    ends[side].push((line.value, piece));
                    self.end_at_edge(side, line.value, piece);
                }
            }
        }
        for list in &mut ends {
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        self.over_seams(&ends);
    }

    /// Two lines of one surface that cross on it.
    fn crossing_on_surface(&mut self, a: usize, b: usize) {
        let (ca, cb) = (self.curve(a), self.curve(b));
        let (Path::Line(la), Path::Line(lb)) = (&ca.path, &cb.path) else { return };
        let (ta, tb) = (lb.value, la.value);
        let within = |d: [f64; 2], t: f64| d[0] < t && t < d[1];
        if !(within(ca.domain, ta) && within(cb.domain, tb)) {
            return;
        }
        if let (Some(p), Some(q)) = (self.inside(a, ta), self.inside(b, tb)) {
            // Two lines that touch on the screen mark a fold, which lies between the one piece and the other.
            let (da, db) = (la.jet(ta).1.truncate(), lb.jet(tb).1.truncate());
            if da.perp_dot(db).abs() > FLAT * da.length() * db.length() {
                self.link(p, q, 0);
            }
        }
    }

    /// A line passes over edges inside its surface: knot lines at which the normal jumps.
    fn knot_lines(&mut self, k: usize) {
        let c = self.curve(k);
        let Path::Line(line) = &c.path else { return };
        let pieces = self.starts[k]..self.starts[k + 1];
        for after in pieces.skip(1) {
            let b = &self.subject.arrangement.pieces[after];
            let a = &self.subject.arrangement.pieces[after - 1];
            if !(matches!(b.entered.as_slice(), [Cut::Own]) && self.is_plain(a) && self.is_plain(b)) {
                continue;
            }
            let t = b.t[0];
            let crossed = |&&e: &&usize| {
                let edge = self.curve(e);
                let Path::Line(l) = &edge.path else { return false };
                l.axis != line.axis && l.value == t && edge.domain[0] < line.value && line.value < edge.domain[1]
            };
            let Some(&e) = self.inner[c.surface].iter().find(crossed) else { continue };
            let Some(on_edge) = self.inside(e, line.value) else { continue };
            let below = matches!(&self.curve(e).path, Path::Line(l) if l.below);
            let (low, high) = if below { (0, 1) } else { (1, 0) };
            for (piece, sheet) in [(after - 1, low), (after, high)] {
                if let Some(more) = self.hidden_by_edge(e, line.value, sheet) {
                    self.link(on_edge, piece, more);
                }
            }
        }
    }

    /// A line ends at an edge of its surface.
    fn end_at_edge(&mut self, side: usize, t: f64, piece: usize) {
        let Some(own) = self.subject.stitching.sides[side].path.line() else { return };
        for k in 0..self.along[side].len() {
            let e = self.along[side][k];
            let edge = self.curve(e);
            let Path::Line(path) = &edge.path else { continue };
            if self.trimmed[e] {
                continue;
            }
            let Some(sheet) = edge.sides.iter().position(|&s| s == side) else { continue };
            let at = if sheet == 0 { t } else { path.nearest(own.point(t)).0 };
            if !(edge.domain[0] < at && at < edge.domain[1]) {
                continue;
            }
            if let (Some(on_edge), Some(more)) = (self.inside(e, at), self.hidden_by_edge(e, at, sheet)) {
                self.link(on_edge, piece, more);
            }
        }
    }

    /// The wedge test: how many other sheets of an edge hide one of them beside the edge at `t`.
    fn hidden_by_edge(&self, edge: usize, t: f64, sheet: usize) -> Option<i32> {
        let sheets = &self.sheets[edge];
        // Of a smooth join, which is drawn but hides nothing, there are none: what goes on over it is a seam's affair.
        let own = self.beside(edge, sheets.get(sheet)?, t)?;
        let mut hidden = 0;
        for (k, other) in sheets.iter().enumerate() {
            if k == sheet {
                continue;
            }
            let other = self.beside(edge, other, t)?;
            if other.side == own.side {
                let scale = 1.0 + own.rise.abs() + other.rise.abs();
                if (other.rise - own.rise).abs() <= FLAT * scale {
                    return None;
                }
                hidden += i32::from(other.rise > own.rise);
            }
        }
        Some(hidden)
    }

    /// Where a sheet of an edge lies beside the point at `t`; none if it is seen edge-on there.
    fn beside(&self, edge: usize, sheet: &Sheet<'_>, t: f64) -> Option<Beside> {
        let c = self.curve(edge);
        let (side, at) = self.side(c, sheet, t)?;
        let along = c.jet(&self.subject.geometry, t).1;
        let line = &sheet.line;
        let (patch, local) = line.place(at);
        let jet = self.subject.geometry.view.patches()[patch].jet(local.x, local.y);
        let inward = if line.axis == Axis::U { jet.du } else { jet.dv };
        let inward = if line.below { -inward } else { inward };
        let direction = along.truncate().try_normalize()?;
        let across = direction.perp_dot(inward.truncate());
        if side == 0 || across.abs() <= FLAT * inward.length() || (across > 0.0) != (side > 0) {
            return None;
        }
        // What of the inward direction runs along the edge gains the depth of the edge.
        let share = direction.dot(inward.truncate()) / along.truncate().length();
        Some(Beside { side: side.into(), rise: (inward.z - share * along.z) / across.abs() })
    }

    /// Lines of two surfaces that meet in a point of a smooth join.
    fn over_seams(&mut self, ends: &[Vec<(f64, usize)>]) {
        let stitching = self.subject.stitching;
        let mut found = Vec::new();
        for edge in stitching.edges.iter().filter(|e| e.class == EdgeClass::Smooth && e.owner()) {
            let [partner] = edge.partners[..] else { continue };
            let [Some(line), Some(other)] = [edge.side, partner].map(|s| stitching.sides[s].path.line()) else {
                continue;
            };
            for &(t, piece) in ends[edge.side].iter().filter(|e| edge.t[0] < e.0 && e.0 < edge.t[1]) {
                let p = line.point(t);
                let at = other.nearest(p).0;
                let k = ends[partner].partition_point(|e| e.0 < at);
                let near = [k.checked_sub(1), Some(k)];
                for &(s, theirs) in near.iter().flatten().filter_map(|&k| ends[partner].get(k)) {
                    let same = other.point(s).distance(p) <= self.subject.reach();
                    if same && self.faces_alike(line, t, other, s) {
                        found.push((piece, theirs));
                    }
                }
            }
        }
        for (a, b) in found {
            self.link(a, b, 0);
        }
    }

    /// Whether two surfaces that join smoothly go on from one another there, and neither is seen edge-on.
    fn faces_alike(&self, a: &Line, ta: f64, b: &Line, tb: f64) -> bool {
        let g = &self.subject.geometry;
        let normal = |l: &Line, t: f64| {
            let (patch, at) = l.place(t);
            g.view.patches()[patch].jet(at.x, at.y).normal().normalize_or_zero()
        };
        let (na, nb) = (normal(a, ta), normal(b, tb));
        let apart = lies_left(g, a, ta) * lies_left_along(g, b, tb, a.jet(ta).1) < 0;
        apart && na.z.abs() > FLAT && nb.z.abs() > FLAT
    }

    /// Links of traced silhouettes: along their chains, and with the lines that pass over them.
    fn silhouettes(&mut self) {
        for chain in &self.subject.chains.chains {
            let pairs = chain.links.windows(2).map(|w| (w[0], w[1]));
            let closing = chain.links.last().zip(chain.links.first()).filter(|_| chain.closed && chain.links.len() > 1);
            for (a, b) in pairs.chain(closing.map(|(a, b)| (*a, *b))) {
                self.joint(a.curve, !a.reversed, b.curve, b.reversed);
            }
        }
        let mut on_patch: Vec<Vec<usize>> = vec![Vec::new(); self.subject.geometry.view.patches().len()];
        for (k, c) in self.subject.curves.iter().enumerate() {
            if let Path::Traced(traced) = &c.path {
                on_patch[traced.patch].push(k);
            }
        }
        let pieces = &self.subject.arrangement.pieces;
        for k in 1..pieces.len() {
            let (a, b) = (&pieces[k - 1], &pieces[k]);
            let own = a.curve == b.curve && matches!(b.entered.as_slice(), [Cut::Own]);
            if !(own && self.is_plain(a) && self.is_plain(b)) {
                continue;
            }
            let Some(towards_eye) = self.own_fold(b.curve, b.t[0]) else { continue };
            let Path::Line(line) = &self.curve(b.curve).path else { continue };
            let (patch, at) = line.place(b.t[0]);
            for &s in &on_patch[patch] {
                let Path::Traced(traced) = &self.curve(s).path else { continue };
                if let Some(piece) = passes(traced, at).and_then(|t| self.inside(s, t)) {
                    let (near, far) = if towards_eye { (k, k - 1) } else { (k - 1, k) };
                    self.link(piece, near, 0);
                    self.link(piece, far, 1);
                }
            }
        }
    }

    /// The end of one silhouette and the end of another that continues it.
    fn joint(&mut self, a: usize, a_last: bool, b: usize, b_last: bool) {
        let g = &self.subject.geometry;
        let (Path::Traced(ta), Path::Traced(tb)) = (&self.curve(a).path, &self.curve(b).path) else { return };
        let (Some(p), Some(q)) = (self.at_end(a, a_last), self.at_end(b, b_last)) else { return };
        // Directions out of the one and into the other.
        let towards = |k: usize, last: bool| {
            let c = self.curve(k);
            if last { c.jet_below(g, c.domain[1]).1 } else { -c.jet(g, c.domain[0]).1 }
        };
        let (out, into) = (towards(a, a_last), -towards(b, b_last));
        match (ta.ends[usize::from(a_last)], tb.ends[usize::from(b_last)]) {
            (CurveEnd::Border, CurveEnd::Border) => {
                let (x, y) = (out.truncate(), into.truncate());
                let straight = x.dot(y) > 0.5 * x.length() * y.length();
                if straight && x.length() > FLAT * out.length() && y.length() > FLAT * into.length() {
                    self.link(p, q, 0);
                }
            }
            (CurveEnd::Cusp, CurveEnd::Cusp) if ta.patch == tb.patch && out.z * into.z > 0.0 => {
                self.link(p, q, if out.z > 0.0 { -1 } else { 1 });
            }
            _ => {}
        }
    }
}

/// A surface and its facing polynomial at a point of a silhouette.
struct Fold {
    jets: [DVec3; 2],
    gradient: DVec2,
}

fn fold_at(subject: &Subject<'_>, patch: usize, at: DVec2) -> Option<Fold> {
    let form = &subject.geometry.forms[patch];
    let [_, fu, fv] = form.gradient(at.x, at.y);
    let jet = subject.geometry.view.patches()[patch].jet(at.x, at.y);
    let gradient = DVec2::new(fu, fv);
    let known = gradient.length() > form.rounding / FLAT && form.edge_factor.iter().all(|&m| m == 0);
    known.then_some(Fold { jets: [jet.du, jet.dv], gradient })
}

/// Whether the two sheets of a fold lie on the left of a silhouette on the screen, in the direction of its parameter.
///
/// Along the direction w in which the surface runs towards the eye, S_w = λ ẑ with λ > 0, the identity N · S_w = 0 gives
/// N · S_ww = −N_w · S_w = −λ ∂_w N_z: the surface curves away from the screen normal N where F grows towards the eye, and to
/// the side of N where it falls.
pub(crate) fn fold_lies_left(
    subject: &Subject<'_>,
    traced: &TracedCurve,
    curve: &SurfaceCurve,
    t: f64,
) -> Option<bool> {
    let g = &subject.geometry;
    let at = traced.local_at(&g.forms[traced.patch], t);
    let Fold { jets: [du, dv], gradient } = fold_at(subject, traced.patch, at)?;
    let w = if du.x.abs() + dv.x.abs() > du.y.abs() + dv.y.abs() {
        DVec2::new(dv.x, -du.x)
    } else {
        DVec2::new(dv.y, -du.y)
    };
    let towards = du.z * w.x + dv.z * w.y;
    let w = w * towards.signum();
    let growth = w.dot(gradient);
    if growth.abs() <= FLAT * w.length() * gradient.length() {
        return None;
    }
    let normal = du.cross(dv).truncate();
    let surface = if growth < 0.0 { normal } else { -normal };
    let along = curve.jet(g, t).1.truncate();
    let side = along.perp_dot(surface);
    (side.abs() > FLAT * along.length() * surface.length()).then_some(side > 0.0)
}

/// The parameter at which a silhouette passes through a point of its patch.
fn passes(traced: &TracedCurve, at: DVec2) -> Option<f64> {
    /// Roots of one polynomial along the line and along the silhouette agree to some roundings over a slope.
    const SAME: f64 = 1e-9;
    for (k, segment) in traced.segments.iter().enumerate() {
        let (a, b) = (traced.vertices[k], traced.vertices[k + 1]);
        let i = usize::from(segment.axis == Variable::V);
        let fraction = (at[i] - a[i]) / (b[i] - a[i]);
        let other = at[1 - i];
        let near = other >= segment.bracket[0] - SAME && other <= segment.bracket[1] + SAME;
        if (0.0..=1.0).contains(&fraction) && near {
            return Some(k as f64 + fraction);
        }
    }
    None
}
