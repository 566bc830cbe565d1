//! How long motion takes.

use glam::DVec3;

/// How far a path may be rounded off at a corner, mm: GRBL's junction deviation as it is shipped ($11).
const JUNCTION_DEVIATION: f64 = 0.01;

/// A motion along which the speed is limited.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    /// Index of the step that it belongs to.
    pub(super) step: usize,
    /// Length, mm; positive.
    pub(super) length: f64,
    /// Directions at its beginning and at its end, of length 1.
    pub(super) directions: [DVec3; 2],
    /// Speed asked for, mm/s; positive.
    pub(super) speed: f64,
}

/// Time in s of each move of a chain that begins and ends at rest, with moves that follow each other without a stop.
///
/// The speed at a corner is that at which the acceleration (mm/s²) would go round a circle that leaves the corner by the junction
/// deviation; see S. K. Jeon, *Improving Grbl: Cornering Algorithm* (2011). Cost: linear.
pub(super) fn seconds(moves: &[Move], acceleration: f64) -> Vec<f64> {
    // Squares of the speed at the border before each move, and at the end.
    let mut squares = vec![0.0; moves.len() + 1];
    for (k, pair) in moves.windows(2).enumerate() {
        let speed = pair[0].speed.min(pair[1].speed);
        squares[k + 1] = corner(pair[0].directions[1], pair[1].directions[0], acceleration).min(speed * speed);
    }
    for (k, motion) in moves.iter().enumerate().rev() {
        squares[k] = f64::min(squares[k], squares[k + 1] + 2.0 * acceleration * motion.length);
    }
    for (k, motion) in moves.iter().enumerate() {
        squares[k + 1] = f64::min(squares[k + 1], squares[k] + 2.0 * acceleration * motion.length);
    }
    let times = moves.iter().enumerate().map(|(k, motion)| {
        let (from, to) = (squares[k], squares[k + 1]);
        // The speed at which speeding up meets slowing down, unless the one asked for is reached before.
        let peak = (acceleration * motion.length + (from + to) / 2.0).sqrt().min(motion.speed);
        let ramps = (2.0 * peak * peak - from - to) / (2.0 * acceleration);
        let time = (2.0 * peak - from.sqrt() - to.sqrt()) / acceleration + (motion.length - ramps).max(0.0) / peak;
        time.max(0.0)
    });
    times.collect()
}

/// Square of the speed at a corner.
fn corner(before: DVec3, after: DVec3, acceleration: f64) -> f64 {
    let cos = -before.dot(after);
    let sin_half = ((1.0 - cos) / 2.0).max(0.0).sqrt();
    if sin_half > 1.0 - 1e-9 {
        return f64::INFINITY;
    }
    acceleration * JUNCTION_DEVIATION * sin_half / (1.0 - sin_half)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(length: f64, speed: f64, direction: DVec3) -> Move {
        Move { step: 0, length, directions: [direction; 2], speed }
    }

    #[test]
    fn one_move_is_a_trapezoid_or_a_triangle() {
        // 10 mm/s at 100 mm/s²: 0.1 s up, 0.1 s down, 0.5 mm each.
        let time = seconds(&[straight(11.0, 10.0, DVec3::X)], 100.0)[0];
        assert!((time - 1.2).abs() < 1e-12, "{time}");
        let time = seconds(&[straight(0.25, 10.0, DVec3::X)], 100.0)[0];
        assert!((time - 0.1).abs() < 1e-12, "{time}");
    }

    #[test]
    fn a_straight_line_in_pieces_takes_the_same_time() {
        for count in [1, 2, 7, 100] {
            let moves = vec![straight(11.0 / f64::from(count), 10.0, DVec3::Y); count as usize];
            let time: f64 = seconds(&moves, 100.0).iter().sum();
            assert!((time - 1.2).abs() < 1e-9, "{count}: {time}");
        }
    }

    #[test]
    fn turning_back_is_a_stop_and_a_right_angle_nearly_one() {
        let back = [straight(11.0, 10.0, DVec3::X), straight(11.0, 10.0, -DVec3::X)];
        assert!((seconds(&back, 100.0).iter().sum::<f64>() - 2.4).abs() < 1e-9);
        let corner = [straight(11.0, 10.0, DVec3::X), straight(11.0, 10.0, DVec3::Y)];
        let time: f64 = seconds(&corner, 100.0).iter().sum();
        assert!(time < 2.4 && time > 2.2, "{time}");
    }

    #[test]
    fn nothing_takes_no_time() {
        assert!(seconds(&[], 100.0).is_empty());
    }
}
