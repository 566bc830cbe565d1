//! Straight moves as all plotters make them.

use glam::DVec3;

/// Time in s of a straight move of `length` mm from rest to rest, at `speed` mm/s and `acceleration` mm/s² at most.
pub(crate) fn seconds(length: f64, speed: f64, acceleration: f64) -> f64 {
    if length * acceleration < speed * speed {
        2.0 * (length / acceleration).sqrt()
    } else {
        length / speed + speed / acceleration
    }
}

/// How much longer a way is than its part along the axis on which that is longest: 1 to √2 on paper. So much faster is the pen than an axis whose motor goes at its
/// own speed.
pub(crate) fn over_longest_axis(way: DVec3) -> f64 {
    let longest = way.abs().max_element();
    if longest > 0.0 { way.length() / longest } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_is_a_triangle_or_a_trapezoid() {
        // 100 mm/s and 100 mm/s²: a second and 50 mm to full speed.
        assert_eq!(seconds(0.0, 100.0, 100.0), 0.0);
        assert_eq!(seconds(25.0, 100.0, 100.0), 1.0);
        assert_eq!(seconds(100.0, 100.0, 100.0), 2.0);
        assert_eq!(seconds(300.0, 100.0, 100.0), 4.0);
    }
}
