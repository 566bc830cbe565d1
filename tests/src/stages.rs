//! The stages of a drawing, for tables of their times.

use penvis::stats::Seconds;

/// A stage: its name, and where its time is.
pub type Column = (&'static str, fn(&Seconds) -> f64);

/// From a model's name or file to the file of a drawing, and all of it.
pub const STAGES: [Column; 10] = [
    ("read", |s| s.read),
    ("view", |s| s.view),
    ("stitch", |s| s.stitch),
    ("extract", |s| s.extract),
    ("arrange", |s| s.arrange),
    ("visibility", |s| s.visibility),
    ("stroke", |s| s.stroke),
    ("page", |s| s.page),
    ("emit", |s| s.emit),
    ("total", |s| s.total),
];

/// Those up to the strokes on the page.
pub const TO_THE_PAGE: [Column; 8] = {
    let [a, b, c, d, e, f, g, h, _, _] = STAGES;
    [a, b, c, d, e, f, g, h]
};
