//! Curves and surfaces: Bézier and B-splines, periodic or not.
//!
//! Control points stand with u fastest, and have the coordinates that their type says: `E2` is x and y, `P3` a weight and
//! then x, y and z multiplied by it. A periodic direction (`KVP`) goes on with the first order − 1 control points again,
//! and has knots for them too.

use std::io::BufRead;

use glam::DVec4;
use penvis_core::nurbs::{Curve, KnotVector, NurbsError, Surface};
use penvis_core::view::MAX_DEGREE;

use super::token::{Kind, Tokens};
use crate::model::fault::ReadError;
use crate::model::import::MOST_POINTS;
use crate::model::text::{number, shown};

/// What came of a curve or surface.
pub(super) enum Spline<T> {
    /// It is read.
    Read(T),
    /// It is of a kind that is not drawn, with what this is called in the report.
    Skipped(String),
}

impl<T> Spline<T> {
    /// What is made of it if it is read.
    pub(super) fn map<U>(self, make: impl FnOnce(T) -> U) -> Spline<U> {
        match self {
            Self::Read(read) => Spline::Read(make(read)),
            Self::Skipped(what) => Spline::Skipped(what),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Basis {
    Bezier,
    BSpline,
}

/// What numbers a control point has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PointType {
    /// Whether there is a weight, which comes first and multiplies the coordinates.
    rational: bool,
    dimension: usize,
}

impl PointType {
    /// The type of this name: E or P, and one digit.
    fn of(name: &str) -> Option<Self> {
        let (rational, digit) = match name.as_bytes() {
            [b'E' | b'e', digit] => (false, digit),
            [b'P' | b'p', digit] => (true, digit),
            _ => return None,
        };
        let dimension = usize::from(digit.checked_sub(b'0')?);
        (1..=9).contains(&dimension).then_some(Self { rational, dimension })
    }

    fn size(self) -> usize {
        self.dimension + usize::from(self.rational)
    }

    fn name(self) -> String {
        format!("{}{}", if self.rational { 'P' } else { 'E' }, self.dimension)
    }
}

/// Reads curves and surfaces, and knows how much they are together.
#[derive(Default)]
pub(super) struct Splines {
    /// Control points of all that have begun.
    points: usize,
}

impl Splines {
    /// Reads a surface, whose keyword was read last, to its end.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn surface<R: BufRead>(&mut self, tokens: &mut Tokens<'_, R>) -> Result<Spline<Surface>, ReadError> {
        let header = match self.header::<2, R>(tokens, "surfaces")? {
            Spline::Read(header) => header,
            Spline::Skipped(what) => return Ok(Spline::Skipped(what)),
        };
        if !(2..=3).contains(&header.of.dimension) {
            tokens.leave()?;
            return Ok(Spline::Skipped(format!("surfaces of points {}", header.of.name())));
        }
        let [length_u, length_v] = header.lengths;
        let knots_u = header.knots(0, tokens, " along u")?;
        let knots_v = header.knots(1, tokens, " along v")?;
        let read = points(tokens, length_u * length_v, header.of)?;
        let (nu, nv) = (knots_u.control_count(), knots_v.control_count());
        let at = |iu: usize, iv: usize| read[(iv % length_v) * length_u + iu % length_u];
        let all = (0..nu).flat_map(|iu| (0..nv).map(move |iv| (iu, iv))).map(|(iu, iv)| at(iu, iv)).collect();
        let surface = Surface::from_homogeneous(knots_u, knots_v, all);
        surface.map(Spline::Read).map_err(|e| tokens.fault(format!("ends a surface that is wrong: {e}")))
    }

    /// Reads a curve in parameters, whose keyword was read last, to its end. Of more coordinates than u and v, the others
    /// say nothing.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn curve<R: BufRead>(&mut self, tokens: &mut Tokens<'_, R>) -> Result<Spline<Curve>, ReadError> {
        let header = match self.header::<1, R>(tokens, "curves")? {
            Spline::Read(header) => header,
            Spline::Skipped(what) => return Ok(Spline::Skipped(what)),
        };
        if header.of.dimension < 2 {
            return Err(
                tokens.fault(format!("has a curve of points {}; one in parameters has u and v", header.of.name()))
            );
        }
        let knots = header.knots(0, tokens, "")?;
        let read = points(tokens, header.lengths[0], header.of)?;
        let flat = |k: usize| DVec4::new(read[k].x, read[k].y, 0.0, read[k].w);
        let all = (0..knots.control_count()).map(|k| flat(k % read.len())).collect();
        let curve = Curve::from_homogeneous(knots, all);
        curve.map(Spline::Read).map_err(|e| tokens.fault(format!("ends a curve that is wrong: {e}")))
    }

    /// Reads what comes before knots and control points.
    fn header<const N: usize, R: BufRead>(
        &mut self,
        tokens: &mut Tokens<'_, R>,
        what: &str,
    ) -> Result<Spline<Header<N>>, ReadError> {
        let kind = tokens.next()?;
        if kind != Kind::Word {
            return Err(tokens.unexpected(kind, "BEZIER or BSPLINE"));
        }
        let basis = match tokens.text() {
            word if word.eq_ignore_ascii_case("BEZIER") => Basis::Bezier,
            word if word.eq_ignore_ascii_case("BSPLINE") => Basis::BSpline,
            word => {
                let name = format!("{what} of the basis {}", shown(word));
                tokens.leave()?;
                return Ok(Spline::Skipped(name));
            }
        };
        let mut kind = tokens.after_attributes()?;
        let mut lengths = [0; N];
        for length in &mut lengths {
            *length = whole(tokens, kind, "a number of control points")?;
            kind = tokens.next()?;
        }
        let mut orders = lengths;
        if basis == Basis::BSpline {
            for order in &mut orders {
                *order = whole(tokens, kind, "an order")?;
                kind = tokens.next()?;
            }
        }
        let of = match PointType::of(tokens.text()) {
            Some(of) if kind == Kind::Word => of,
            _ => return Err(tokens.unexpected(kind, "a type of points, such as E3 or P3,")),
        };
        if let Some(order) = orders.iter().find(|order| !(2..=MAX_DEGREE + 1).contains(order)) {
            return Err(tokens.fault(format!("has order {order}, degree plus 1; there are 2 to {}", MAX_DEGREE + 1)));
        }
        let count = lengths.iter().try_fold(1_usize, |count, length| count.checked_mul(*length));
        self.points = count.and_then(|count| self.points.checked_add(count)).unwrap_or(usize::MAX);
        if self.points > MOST_POINTS {
            return Err(tokens.fault(format!(
                "announces more than {MOST_POINTS} control points; no pen can draw so much, so correct or simplify it"
            )));
        }
        Ok(Spline::Read(Header { basis, lengths, orders, of }))
    }
}

/// What comes before knots and control points, in as many directions as it has parameters.
struct Header<const N: usize> {
    basis: Basis,
    /// Numbers of control points.
    lengths: [usize; N],
    orders: [usize; N],
    of: PointType,
}

impl<const N: usize> Header<N> {
    /// Reads the knots in a direction, or makes those of a Bézier basis.
    fn knots<R: BufRead>(
        &self,
        direction: usize,
        tokens: &mut Tokens<'_, R>,
        along: &str,
    ) -> Result<KnotVector, ReadError> {
        let (length, order) = (self.lengths[direction], self.orders[direction]);
        let wrong = |tokens: &Tokens<'_, R>, e: NurbsError| tokens.fault(format!("has wrong knots{along}: {e}"));
        if self.basis == Basis::Bezier {
            return KnotVector::bezier(order - 1, [0.0, 1.0]).map_err(|e| wrong(tokens, e));
        }
        for expected in [Kind::Open, Kind::Word] {
            let kind = tokens.next()?;
            if kind != expected {
                return Err(tokens.unexpected(kind, "[KV or [KVP"));
            }
        }
        let (size, kind) = match tokens.text() {
            word if word.eq_ignore_ascii_case("KV") => (length + order, ""),
            word if word.eq_ignore_ascii_case("KVP") => (length + 2 * order - 1, " of a period"),
            _ => return Err(tokens.unexpected(Kind::Word, "KV or KVP")),
        };
        let mut knots = Vec::new();
        let mut token = tokens.after_attributes()?;
        while token != Kind::Close && knots.len() <= size {
            if token != Kind::Word {
                return Err(tokens.unexpected(token, "a knot"));
            }
            knots.push(number(tokens.text()).map_err(|problem| tokens.fault(problem))?);
            token = tokens.next()?;
        }
        if knots.len() != size {
            let got = if knots.len() > size { "more knots".to_owned() } else { format!("{} knots", knots.len()) };
            return Err(tokens.fault(format!(
                "has {got}{along}, but {length} control points{kind} of order {order} have {size} knots"
            )));
        }
        KnotVector::new(knots, order - 1).map_err(|e| wrong(tokens, e))
    }
}

/// Reads control points and the end of their block, as homogeneous coordinates.
fn points<R: BufRead>(tokens: &mut Tokens<'_, R>, count: usize, of: PointType) -> Result<Vec<DVec4>, ReadError> {
    let mut points = Vec::new();
    for k in 0..count {
        match tokens.next()? {
            Kind::Open => points.push(point(tokens, of)?),
            Kind::Close => return Err(tokens.fault(format!("ends after {k} of {count} control points"))),
            kind => return Err(tokens.unexpected(kind, "a control point")),
        }
    }
    match tokens.next()? {
        Kind::Close => Ok(points),
        kind => Err(tokens.unexpected(kind, &format!("`]` after {count} control points"))),
    }
}

fn point<R: BufRead>(tokens: &mut Tokens<'_, R>, of: PointType) -> Result<DVec4, ReadError> {
    let mut numbers = [0.0; 10];
    let mut count = 0;
    let mut token = tokens.after_attributes()?;
    while token == Kind::Word && count < of.size() {
        numbers[count] = number(tokens.text()).map_err(|problem| tokens.fault(problem))?;
        count += 1;
        token = tokens.next()?;
    }
    if token != Kind::Close || count < of.size() {
        let expected = format!("control point of type {}, which has {} numbers", of.name(), of.size());
        return Err(match token {
            Kind::Close => tokens.fault(format!("has {count} numbers in a {expected}")),
            _ => tokens.unexpected(token, &format!("`]` of a {expected},")),
        });
    }
    let (w, xyz) = if of.rational { (numbers[0], &numbers[1..]) } else { (1.0, &numbers[..]) };
    if w <= 0.0 {
        return Err(tokens.fault(format!("has weight {w}; weights must be positive and finite")));
    }
    // Numbers beyond the type's are zero still.
    Ok(DVec4::new(xyz[0], xyz[1], xyz[2], w))
}

/// The token that was read last as a whole number.
///
/// # Errors
/// If it is none.
pub(super) fn whole<R: BufRead>(tokens: &Tokens<'_, R>, kind: Kind, expected: &str) -> Result<usize, ReadError> {
    match tokens.text().parse() {
        Ok(n) if kind == Kind::Word => Ok(n),
        _ => Err(tokens.unexpected(kind, expected)),
    }
}
