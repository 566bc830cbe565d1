//! Shadows held against triangles.
//!
//! A place on a surface is visible if the oracle sees it from the eye, and in shadow if the oracle does not see it from the light, or if the
//! eye looks at the other side of the surface than the light does. That is all there is to it, and it shares nothing with the
//! polygons in parameters that shadows are made of.

use glam::{DVec2, DVec3};
use penvis::shadow::{Shadow, Shadows};
use penvis_core::pipeline::Prepared;
use penvis_core::scene::Scene;

use crate::oracle::{Oracle, Place, Sight, Site, Verdict};

/// What the places say of shadows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lightings {
    /// Visible places that the oracle finds in shadow, not near a border of it.
    pub dark: usize,
    /// Visible places that it finds lit.
    pub lit: usize,
    /// Of both, those that are on the wrong side of the border.
    pub wrong: usize,
    /// Visible places too near a border of a shadow to tell.
    pub near: usize,
    /// Visible places of which the oracle does not know whether they are lit.
    pub doubtful: usize,
}

/// Judges so many places, evenly at random in the parameters of the surfaces. `light` is the direction to the light in model space; within `margin` of
/// a border, in units of the screen, nothing is judged.
#[must_use]
pub fn against(
    scene: &Scene,
    prepared: &Prepared,
    sight: Sight,
    light: DVec3,
    shadows: &Shadows,
    margin: f64,
    count: usize,
) -> Lightings {
    let up = if light.x == 0.0 && light.y == 0.0 { DVec3::Y } else { DVec3::Z };
    let from_eye = Oracle::new(scene, sight);
    let from_light = Oracle::new(scene, Sight::Parallel { direction: light, up });
    let view = prepared.geometry().view;
    let mut random = fastrand::Rng::with_seed(7);
    let mut out = Lightings::default();
    for _ in 0..count {
        let surface = random.usize(..scene.surfaces.len());
        let own = &scene.surfaces[surface].surface;
        let mut between = |[a, b]: [f64; 2]| a + (b - a) * random.f64();
        let uv = DVec2::new(between(own.domain_u()), between(own.domain_v()));
        let point = view.model_point(surface, uv);
        let place = Place { point, surface, uv, site: Site::Sheet };
        if from_eye.judge(&place) != Verdict::Visible {
            continue;
        }
        // Towards the eye, by which two directions on the screen are none in space.
        let eye = match sight {
            Sight::Parallel { direction, .. } => direction.normalize(),
            Sight::Central { eye, .. } => (eye - point).normalize(),
        };
        let normal = view.model_jet(surface, uv, [false; 2]).normal().normalize_or_zero();
        let [to_eye, to_light] = [normal.dot(eye), normal.dot(light.normalize())];
        // Where one of them grazes the surface the triangles do not tell the side.
        if to_eye.abs().min(to_light.abs()) < 1e-3 {
            out.doubtful += 1;
            continue;
        }
        let is_dark = to_eye * to_light < 0.0
            || match from_light.judge(&place) {
                Verdict::Visible => false,
                Verdict::Hidden(_) => true,
                Verdict::Ambiguous(_) => {
                    out.doubtful += 1;
                    continue;
                }
            };
        let screen = sight.project(point).truncate();
        let shadow = shadows.shadows.iter().find(|s| s.surface == surface);
        let (inside, distance) = shadow.map_or((false, f64::INFINITY), |s| within(s, screen));
        if distance <= margin {
            out.near += 1;
            continue;
        }
        *(if is_dark { &mut out.dark } else { &mut out.lit }) += 1;
        if is_dark != inside {
            out.wrong += 1;
            eprintln!(
                "{} {place:?}: dark {is_dark}, n·e {to_eye}, n·l {to_light}, {distance} from a border",
                scene.name
            );
        }
    }
    out
}

/// Whether a point of the screen is in a shadow, by the even-odd rule, and how far it is from its border.
fn within(shadow: &Shadow, q: DVec2) -> (bool, f64) {
    let (mut inside, mut nearest) = (false, f64::INFINITY);
    for own in &shadow.loops {
        for (a, b) in own.iter().zip(own.iter().cycle().skip(1)).map(|(a, b)| (a.screen, b.screen)) {
            if (a.y <= q.y) != (b.y <= q.y) {
                inside ^= q.x < a.x + (b.x - a.x) * (q.y - a.y) / (b.y - a.y);
            }
            let d = b - a;
            let along = if d == DVec2::ZERO { 0.0 } else { ((q - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            nearest = nearest.min(q.distance(a + d * along));
        }
    }
    (inside, nearest)
}
