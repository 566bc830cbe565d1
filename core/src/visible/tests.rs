use super::*;
use alloc::vec;

/// An edge along these points.
fn edge(points: &[[f64; 2]]) -> VisibleEdge {
    let point = |p: &[f64; 2]| BorderPoint { screen: DVec2::from_array(*p), uv: DVec2::ZERO };
    VisibleEdge { kind: CurveKind::Boundary, own: true, points: points.iter().map(point).collect() }
}

#[test]
fn a_visible_hole_takes_its_area_away() {
    let far = 1e6;
    let at = |p: [f64; 2]| [p[0] + far, p[1] + far];
    let outer = VisibleLoop {
        edges: vec![
            edge(&[at([0.0, 0.0]), at([4.0, 0.0]), at([4.0, 3.0])]),
            edge(&[at([4.0, 3.0]), at([0.0, 3.0]), at([0.0, 0.0])]),
        ],
    };
    let hole = VisibleLoop {
        edges: vec![edge(&[at([1.0, 1.0]), at([1.0, 2.0]), at([2.0, 2.0]), at([2.0, 1.0]), at([1.0, 1.0])])],
    };
    assert_eq!((outer.area(), hole.area()), (12.0, -1.0));
    assert_eq!(VisibleRegion { surface: 0, loops: vec![outer, hole] }.area(), 11.0);
}
