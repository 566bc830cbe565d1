//! A scene with everything that its drawing takes.

use alloc::string::String;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};
use penvis_core::extract::{Style, Styles};
use penvis_core::pipeline::DrawOptions;
use penvis_core::scene::{Facet, Scene, SceneSurface};
use penvis_core::view::{Camera, CameraError};
use penvis_core::visibility::Method;

use super::file::{Place, SceneError, frame, records};
use super::record::{self, HeadRecord, PieceRecord, SurfaceRecord};
use crate::line::LINE_CHARS;

/// From where a scene is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sight {
    /// Parallel projection.
    Orthographic {
        /// From the model to the eye, any length.
        eye_direction: DVec3,
        /// Drawn upwards.
        up: DVec3,
    },
    /// Exact perspective.
    Perspective {
        /// The eye.
        eye: DVec3,
        /// The point looked at.
        target: DVec3,
        /// Drawn upwards.
        up: DVec3,
    },
}

impl Sight {
    /// The camera.
    ///
    /// # Errors
    /// If a coordinate is not finite, there is no direction, or up is parallel to it.
    pub fn camera(&self) -> Result<Camera, CameraError> {
        match *self {
            Self::Orthographic { eye_direction, up } => Camera::orthographic(eye_direction, up),
            Self::Perspective { eye, target, up } => Camera::perspective(eye, target, up),
        }
    }
}

/// How a surface is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Its curves.
    pub style: Style,
    /// The pen of what is visible, from 1.
    pub pen: u32,
    /// The pen of what is hidden, if it is drawn.
    pub hidden: Option<u32>,
}

/// How strokes become G-code.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// From the screen to the machine in mm: x and y are each a row [a, b, c] for a·x + b·y + c.
    pub map: [[f64; 3]; 2],
    /// Feed with the pen down, mm/min.
    pub draw_feed: f64,
    /// Lines before the drawing, the pen raised by the last.
    pub start: String,
    /// Lines that lower the pen.
    pub down: String,
    /// Lines that raise it.
    pub up: String,
    /// Lines that have the pen changed to each that is used, with the pen up; in the order of the pens.
    pub changes: Vec<(u32, String)>,
    /// Lines after the drawing, with the pen up.
    pub end: String,
}

impl Program {
    /// A point of the screen in the machine's mm.
    #[must_use]
    pub fn to_machine(&self, screen: DVec2) -> DVec2 {
        let [x, y] = self.map.map(|[a, b, c]| a * screen.x + b * screen.y + c);
        DVec2::new(x, y)
    }

    fn lines(&self) -> [&str; 4] {
        [&self.start, &self.down, &self.up, &self.end]
    }
}

/// A scene, the view of it, what is wanted of it, and how it gets on paper.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredScene {
    /// The surfaces.
    pub scene: Scene,
    /// The view.
    pub sight: Sight,
    /// A look for each surface.
    pub looks: Vec<Look>,
    /// What is wanted; curves and isocurves are those of the looks.
    pub options: DrawOptions,
    /// Largest distance between a curve and its polyline, screen units.
    pub tolerance: f64,
    /// How strokes become G-code.
    pub program: Program,
}

impl StoredScene {
    /// The bytes: header, scene, checksum.
    ///
    /// # Errors
    /// What [`unpack`](Self::unpack) would refuse.
    pub fn pack(&self) -> Result<Vec<u8>, SceneError> {
        self.check()?;
        let mut out = Vec::new();
        let (perspective, sight) = match self.sight {
            Sight::Orthographic { eye_direction, up } => (false, [eye_direction, DVec3::ZERO, up]),
            Sight::Perspective { eye, target, up } => (true, [eye, target, up]),
        };
        let head = HeadRecord {
            name: &self.scene.name,
            perspective,
            sight: sight.map(|v| v.to_array()),
            deepest: self.options.deepest,
            propagate: self.options.visibility == Method::Propagate,
            clusters: self.options.clusters,
            smooth_angle: self.options.smooth_angle,
            tolerance: self.tolerance,
            map: self.program.map,
            draw_feed: self.program.draw_feed,
            lines: self.program.lines(),
            changes: self.program.changes.iter().map(|(pen, lines)| (*pen, lines.as_str())).collect(),
            surfaces: self.scene.surfaces.len() as u32,
        };
        let large = |_| SceneError::TooLarge;
        out = postcard::to_extend(&head, out).map_err(large)?;
        for (s, look) in self.scene.surfaces.iter().zip(&self.looks) {
            let points = s.surface.homogeneous();
            let knots = [s.surface.knots_u(), s.surface.knots_v()];
            let raw_knots = knots.map(|k| record::raw(k.as_slice().iter().copied()));
            let all_one = points.iter().all(|h| h.w == 1.0);
            let record = SurfaceRecord {
                name: &s.name,
                curves: record::curve_bits(look.style.curves),
                isos: look.style.isos,
                pen: look.pen,
                hidden: look.hidden,
                crease_angle: s.facet.map(|f| f.crease_angle),
                // At most MAX_DEGREE.
                degrees: knots.map(|k| k.degree() as u8),
                knots: [&raw_knots[0], &raw_knots[1]],
                points: &record::raw(points.iter().flat_map(|h| [h.x, h.y, h.z])),
                weights: &record::raw(points.iter().filter(|_| !all_one).map(|h| h.w)),
                loops: s.trims.as_ref().map(|t| t.loops().len() as u32),
            };
            out = postcard::to_extend(&record, out).map_err(large)?;
            for l in s.trims.iter().flat_map(|t| t.loops()) {
                out = postcard::to_extend(&(l.pieces().len() as u32), out).map_err(large)?;
                for p in l.pieces() {
                    let points = record::raw(p.control_points().iter().flat_map(|h| h.to_array()));
                    let record = PieceRecord {
                        from: p.from().to_array(),
                        points: &points,
                        left: p.keeps_left(),
                        edge: p.edge(),
                    };
                    out = postcard::to_extend(&record, out).map_err(large)?;
                }
            }
        }
        frame(&out).ok_or(SceneError::TooLarge)
    }

    /// The scene of these bytes. Memory: what the scene takes, in the order of the bytes.
    ///
    /// # Errors
    /// If they are damaged, of another version, or say what cannot be.
    pub fn unpack(bytes: &[u8]) -> Result<Self, SceneError> {
        let bytes = records(bytes)?;
        let bad = |record| SceneError::Record { record };
        let (head, mut bytes) = postcard::take_from_bytes::<HeadRecord<'_>>(bytes).map_err(|_| bad(Place::Head))?;
        let [a, b, up] = head.sight.map(DVec3::from_array);
        let sight = if head.perspective {
            Sight::Perspective { eye: a, target: b, up }
        } else {
            Sight::Orthographic { eye_direction: a, up }
        };
        let (mut surfaces, mut looks) = (Vec::new(), Vec::new());
        for index in 0..head.surfaces as usize {
            let bad = || bad(Place::Surface(index));
            let (record, rest) = postcard::take_from_bytes::<SurfaceRecord<'_>>(bytes).map_err(|_| bad())?;
            bytes = rest;
            let wrong = |source| SceneError::Surface { index, source };
            let surface = record::surface(&record).ok_or_else(bad)?.map_err(wrong)?;
            let mut trims = None;
            if let Some(loops) = record.loops {
                let (found, rest) = record::trims(&surface, loops, bytes).ok_or_else(bad)?;
                bytes = rest;
                trims = Some(found.map_err(|source| SceneError::Trims { index, source })?);
            }
            let facet = record.crease_angle.map(|crease_angle| Facet { crease_angle });
            let curves = record::curve_set(record.curves).ok_or_else(bad)?;
            looks.push(Look { style: Style { curves, isos: record.isos }, pen: record.pen, hidden: record.hidden });
            surfaces.push(SceneSurface { name: record.name.into(), surface, trims, facet });
        }
        if !bytes.is_empty() {
            return Err(bad(Place::End));
        }
        let [start, down, up, end] = head.lines.map(String::from);
        let changes = head.changes.into_iter().map(|(pen, lines)| (pen, lines.into())).collect();
        let stored = Self {
            scene: Scene { name: head.name.into(), surfaces },
            sight,
            looks,
            options: DrawOptions {
                deepest: head.deepest,
                visibility: if head.propagate { Method::Propagate } else { Method::Rays },
                clusters: head.clusters,
                smooth_angle: head.smooth_angle,
                ..DrawOptions::default()
            },
            tolerance: head.tolerance,
            program: Program { map: head.map, draw_feed: head.draw_feed, start, down, up, changes, end },
        };
        stored.check()?;
        Ok(stored)
    }

    /// Whether all numbers and lines are what they may be.
    fn check(&self) -> Result<(), SceneError> {
        self.sight.camera()?;
        let range = |ok: bool, what| if ok { Ok(()) } else { Err(SceneError::Range { what }) };
        let positive = |x: f64| x.is_finite() && x > 0.0;
        range(positive(self.tolerance), "tolerance")?;
        range(positive(self.program.draw_feed), "feed")?;
        range(self.program.map.iter().flatten().all(|x| x.is_finite()), "place on the paper")?;
        range((0.0..=core::f64::consts::PI).contains(&self.options.smooth_angle), "angle of smooth joins")?;
        range(self.looks.len() == self.scene.surfaces.len(), "number of looks")?;
        for (s, look) in self.scene.surfaces.iter().zip(&self.looks) {
            let points = s.surface.homogeneous();
            let within = |h: &DVec4| (h.truncate() / h.w).abs().max_element() <= LARGEST_COORDINATE;
            range(points.iter().all(within), "size")?;
            range(look.style.isos <= MOST_ISOS, "number of isocurves")?;
            range(s.facet.is_none_or(|f| (0.0..=core::f64::consts::PI).contains(&f.crease_angle)), "crease angle")?;
        }
        let plain = |line: &str| line.len() <= LINE_CHARS && line.bytes().all(|b| (b' '..=b'~').contains(&b));
        let changes = self.program.changes.iter().map(|(_, lines)| lines.as_str());
        if self.program.lines().into_iter().chain(changes).any(|lines| !lines.lines().all(plain)) {
            return Err(SceneError::Line);
        }
        Ok(())
    }

    /// The styles of the surfaces.
    #[must_use]
    pub fn styles(&self) -> Styles {
        Styles::new(self.looks.iter().map(|look| look.style).collect())
    }
}

/// Most isocurves a direction.
const MOST_ISOS: u32 = 1000;

/// Largest coordinate. Areas of normals, squared, are sixth powers of lengths, and have to stay in the range of f64.
const LARGEST_COORDINATE: f64 = 1e50;

#[cfg(test)]
pub(super) mod tests {
    use alloc::vec;

    use penvis_core::extract::CurveSet;
    use penvis_core::shape::{Frame, plane, polyline, torus};
    use penvis_core::trim::{TrimCurve, Trims};

    use super::*;
    use crate::scene::HEADER_BYTES;

    /// A torus before a plane with a triangle cut out, one of them a facet.
    pub(in crate::scene) fn scene() -> StoredScene {
        let ring = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let sheet = plane(DVec3::new(-5.0, -5.0, -2.0), 10.0 * DVec3::X, 10.0 * DVec3::Y).unwrap();
        let corners = [DVec3::ZERO, DVec3::X, DVec3::ONE.with_z(0.0), DVec3::Y, DVec3::ZERO];
        let hole = [DVec3::new(0.3, 0.3, 0.0), DVec3::new(0.4, 0.8, 0.0), DVec3::new(0.7, 0.6, 0.0)];
        let side = |edge: Option<u32>| move |w: &[DVec3]| TrimCurve { curve: polyline(w).unwrap(), edge };
        let outer = corners.windows(2).map(side(Some(7))).collect();
        let inner =
            [[hole[0], hole[1]], [hole[1], hole[2]], [hole[2], hole[0]]].iter().map(|w| side(None)(w)).collect();
        let trims = Trims::oriented(&sheet, [false; 2], &[outer, inner]).unwrap();
        let facet = Some(Facet { crease_angle: 0.5 });
        let sheet = SceneSurface { trims: Some(trims), facet, ..SceneSurface::new("sheet", sheet) };
        let scene = Scene { name: "ring and sheet".into(), surfaces: vec![SceneSurface::new("ring", ring), sheet] };
        let look = |isos| Look { style: Style { curves: CurveSet::default(), isos }, pen: 1, hidden: None };
        StoredScene {
            scene,
            sight: Sight::Perspective { eye: DVec3::new(10.0, -20.0, 15.0), target: DVec3::ZERO, up: DVec3::Z },
            looks: vec![look(3), Look { hidden: Some(2), ..look(0) }],
            options: DrawOptions { deepest: u32::MAX, ..DrawOptions::default() },
            tolerance: 1e-3,
            program: Program {
                map: [[10.0, 0.0, 100.0], [0.0, 10.0, 100.0]],
                draw_feed: 2000.0,
                start: "G21\nG90\nM3 S0\n".into(),
                down: "M3 S1000\nG4 P0.2\n".into(),
                up: "M3 S0\nG4 P0.15\n".into(),
                changes: vec![(1, "M0\n".into()), (2, "M0\n".into())],
                end: "M5\n".into(),
            },
        }
    }

    #[test]
    fn what_was_packed_is_unpacked_bit_for_bit() {
        let stored = scene();
        let bytes = stored.pack().unwrap();
        let back = StoredScene::unpack(&bytes).unwrap();
        assert_eq!(back, stored);
        assert_eq!(back.pack().unwrap(), bytes);
    }

    #[test]
    fn records_that_end_early_or_late_are_refused_by_name() {
        let bytes = scene().pack().unwrap();
        let records = &bytes[HEADER_BYTES..];
        for length in 0..records.len() {
            let error = StoredScene::unpack(&frame(&records[..length]).unwrap()).unwrap_err();
            assert!(matches!(error, SceneError::Record { record: Place::Head | Place::Surface(0..2) }), "{error}");
        }
        let longer = [records, &[0]].concat();
        let error = StoredScene::unpack(&frame(&longer).unwrap()).unwrap_err();
        assert_eq!(error, SceneError::Record { record: Place::End });
    }

    #[test]
    fn no_byte_in_the_records_does_harm() {
        let bytes = scene().pack().unwrap();
        let records = &bytes[HEADER_BYTES..];
        let mut refused = 0;
        for at in 0..records.len() {
            for bit in [at % 8, 7] {
                let mut other = records.to_vec();
                other[at] ^= 1 << bit;
                match StoredScene::unpack(&frame(&other).unwrap()) {
                    // What is read is what is packed again.
                    Ok(read) => assert_eq!(StoredScene::unpack(&read.pack().unwrap()), Ok(read)),
                    Err(error) => {
                        refused += 1;
                        assert!(!alloc::format!("{error}").contains('\n'));
                    }
                }
            }
        }
        assert!(refused > 100, "{refused}");
    }

    #[test]
    fn what_cannot_be_drawn_is_not_packed() {
        let refused = |change: &dyn Fn(&mut StoredScene)| {
            let mut stored = scene();
            change(&mut stored);
            stored.pack().unwrap_err()
        };
        assert_eq!(refused(&|s| s.tolerance = 0.0), SceneError::Range { what: "tolerance" });
        assert_eq!(refused(&|s| s.program.draw_feed = f64::INFINITY), SceneError::Range { what: "feed" });
        assert_eq!(refused(&|s| s.looks.truncate(1)), SceneError::Range { what: "number of looks" });
        assert_eq!(refused(&|s| s.looks[0].style.isos = 1001), SceneError::Range { what: "number of isocurves" });
        assert_eq!(refused(&|s| s.program.up = "G1 Z5 \u{1}".into()), SceneError::Line);
        assert_eq!(refused(&|s| s.program.changes[1].1 = "M".repeat(80)), SceneError::Line);
        let sight = Sight::Orthographic { eye_direction: DVec3::Z, up: DVec3::Z };
        assert_eq!(refused(&|s| s.sight = sight), SceneError::View(CameraError::UpAlongView));
    }
}
