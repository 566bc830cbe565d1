//! The arguments of drawing as they are typed. What they mean is checked in [`options`](crate::options).

use std::path::PathBuf;

use clap::{Args, Parser};

use crate::options::Arcs;

/// Arguments of `penvis draw`.
#[derive(Clone, Debug, Args)]
pub struct DrawArgs {
    /// Built-in models (`penvis info --list`), model files or scenes (`penvis scene`), of which several are drawn as one scene; or drawings: .svg, .json, .gcode, .nc, .hpgl, .plt
    #[arg(required = true, value_name = "MODEL|DRAWING")]
    pub models: Vec<String>,
    /// File to write, by extension: .svg, .gcode, .nc, .hpgl, .plt, .png, .json; may be given several times
    #[arg(short, long, required = true, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Plotter that G-code or HPGL is written for (`penvis devices`)
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Write counts and seconds per stage to a JSON file
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Show the ways with the pen up too, in .png
    #[arg(long, conflicts_with = "render")]
    pub show_travel: bool,
    /// Write what is visible of every surface as filled shapes on the same page, .svg or .json
    #[arg(long, value_name = "FILE", conflicts_with = "render")]
    pub emit_regions: Option<PathBuf>,
    /// Paint the surfaces, lit by --light, instead of drawing: a quick look, as .png, that lies on the page as the drawing
    /// will
    #[arg(long, conflicts_with_all = ["stats", "shadows"])]
    pub render: bool,
    /// What is drawn, and on which paper
    #[command(flatten)]
    pub drawing: DrawingArgs,
    /// The order of strokes
    #[command(flatten)]
    pub path: PathArgs,
}

/// What is drawn, and on which paper: the arguments of every command that computes a drawing.
#[derive(Clone, Debug, PartialEq, Args)]
#[command(next_help_heading = "Drawing")]
pub struct DrawingArgs {
    /// Direction to the eye: front, back, left, right, top, bottom, iso, or X,Y,Z [default: the scene's or the model's own, or iso]
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true)]
    pub view: Option<String>,
    /// Direction that is upwards on the paper [default: the model's own, or 0,0,1]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub up: Option<String>,
    /// Perspective in which the whole model fills an angle of so many degrees
    #[arg(long, value_name = "DEGREES")]
    pub perspective: Option<f64>,
    /// Curves to ink, of boundary, crease, silhouette, iso, smooth (joins), intersection (of surfaces)
    /// [default: the scene's, or boundary,crease,silhouette,iso]
    #[arg(long, value_name = "KINDS")]
    pub curves: Option<String>,
    /// Isocurves in each direction of a surface, equally far apart in its parameter [default: the
    /// scene's, or 8]
    #[arg(long, value_name = "N", conflicts_with_all = ["iso_spacing", "shade"])]
    pub iso: Option<u32>,
    /// Isocurves instead that are no farther apart than this on the paper, in mm, and end where they have come near enough
    #[arg(long, value_name = "MM")]
    pub iso_spacing: Option<f64>,
    /// Which of these isocurves, or of those of --fill iso: u, v (those along which it runs), both, or auto (the fewer and longer on each surface)
    #[arg(long, value_name = "DIRECTION", default_value = "auto")]
    pub iso_direction: String,
    /// Where their spacing is measured: paper, or surface (in space on surfaces that turn away from the eye, so that
    /// curves crowd towards outlines)
    #[arg(long, value_name = "WHERE", default_value = "paper")]
    pub iso_metric: String,
    /// Draw these isocurves coarse to fine in N layers, each with half the spacing of the one before, so that a plot that
    /// is stopped early is a whole picture
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub iso_levels: u32,
    /// Let the spacing follow a tone, from twice the width of the pen (or --iso-spacing) where it is dark to no curves where it
    /// is light: lambert (the light), depth (what is near is dark), or a darkness from 0 to 1
    #[arg(long, value_name = "TONE")]
    pub shade: Option<String>,
    /// Direction to the light as the viewer sees it: to the right, up, towards the viewer
    #[arg(long, value_name = "X,Y,Z", default_value = "-1,1,1", allow_hyphen_values = true)]
    pub light: String,
    /// Darken what lies in the shadow of --light: all lines of --fill are drawn there, and elsewhere only those that --shade asks
    /// for. --emit-regions writes the shadows too
    #[arg(long)]
    pub shadows: bool,
    /// Cover what is visible of surfaces with lines, which take the place of isocurves unless --curves or --iso asks for these: hatch
    /// (parallel), cross (both ways), contour (along the outlines, one within the other), iso (isocurves), or none. They follow --shade [default: the scene's, or none]
    #[arg(long, value_name = "KIND")]
    pub fill: Option<String>,
    /// Angle of these lines, counter-clockwise from the lower side of the sheet [default: the scene's, or 45]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    pub fill_angle: Option<f64>,
    /// Their distance on the paper; with --shade, where it is darkest [default: the scene's, or 1, or twice the width of the pen with
    /// --shade]
    #[arg(long, value_name = "MM")]
    pub fill_pitch: Option<f64>,
    /// What they keep from outlines [default: the scene's, or half the width of the pen, or with contour what they keep from one another]
    #[arg(long, value_name = "MM")]
    pub fill_gap: Option<f64>,
    /// Largest angle between two facets of a mesh that stand for one smooth surface; where they meet at a larger one there is a
    /// crease [default: the scene's, or 30]
    #[arg(long, value_name = "DEGREES")]
    pub crease_angle: Option<f64>,
    /// Width in mm of the pens that have none in the scene: in SVG and PNG, and for --shade
    #[arg(long, value_name = "MM", default_value_t = 0.3)]
    pub pen_width: f64,
    /// Pens by what they draw: LAYER=N for boundary, crease, silhouette, iso, smooth, intersection, hatch, iso-K (with --iso-levels), hidden,
    /// hidden-K (with --qi), marks or title, or a layer of a drawing, or N for all that is visible [default: the scene's, or 1, and pens beyond it for what is hidden]
    #[arg(long, value_name = "LAYER=N", value_delimiter = ',')]
    pub pen: Vec<String>,
    /// What becomes of hidden curves: omit, dashed, or layer (in full, with the next pen) [default: the scene's, or omit, or
    /// layer with --qi]
    #[arg(long, value_name = "HOW")]
    pub hidden: Option<String>,
    /// Cut curves back by this much where they pass behind the outline of something nearer, in mm
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    pub halo: f64,
    /// Draw what has up to N sheets of surface in front of it, each number of sheets on a layer and with a pen of its own,
    /// or in shorter dashes [default: visible curves only, or with --hidden all of them alike]
    #[arg(long, value_name = "N")]
    pub qi: Option<u32>,
    /// How visibility is found: rays (several to each piece of a curve), or propagate (one ray decides for all that is
    /// linked to it)
    #[arg(long, value_name = "HOW", default_value = "rays")]
    pub visibility: String,
    /// Give up, with nothing written, if the drawing takes longer than this to compute
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
    /// Largest distance in mm between a curve and its polyline [default: the scene's, or 0.01]
    #[arg(long, value_name = "MM")]
    pub tolerance: Option<f64>,
    /// Sheet: a5, a4, a3, a2, letter, legal, or a size such as 200x150mm [default: the scene's, or a4]
    #[arg(long, value_name = "PAPER")]
    pub paper: Option<String>,
    /// Long side of the sheet from left to right; the way named sheets lie by default
    #[arg(long)]
    pub landscape: bool,
    /// Long side of the sheet from bottom to top
    #[arg(long, conflicts_with = "landscape")]
    pub portrait: bool,
    /// Margin on all sides in mm [default: the scene's, or 15, or a tenth of the shorter side if that is less]
    #[arg(long, value_name = "MM")]
    pub margin: Option<f64>,
    /// Size of the picture as paper:model, such as 1:2, lengths of the model in mm [default: the scene's, or as large as the margins allow]
    #[arg(long, value_name = "RATIO", conflicts_with_all = ["width", "height"])]
    pub scale: Option<String>,
    /// Width of the picture on the paper: 120mm, 12cm, 5in, or a number of mm
    #[arg(long, value_name = "LENGTH", conflicts_with = "height")]
    pub width: Option<String>,
    /// Height of the picture on the paper
    #[arg(long, value_name = "LENGTH")]
    pub height: Option<String>,
    /// Where its lower left corner is put, from that of the sheet, or center [default: the scene's, or center]
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pub position: Option<String>,
    /// Draw a cross in each corner inside the margins, with each pen that is used, to bring sheets and pens into register [default: the scene's]
    #[arg(long)]
    pub marks: bool,
    /// Write a line of text at the lower left inside the margins [default: the scene's]
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Cut off what lies beyond the margins, or beyond the reach of the plotter, rather than refuse a picture that does not fit
    #[arg(long)]
    pub clip: bool,
}

/// How the pen goes through a drawing: the arguments of the commands that write or plot one.
#[derive(Clone, Debug, PartialEq, Args)]
#[command(next_help_heading = "Path of the pen")]
pub struct PathArgs {
    /// Join strokes of a layer whose ends are no farther apart than this, and draw once what a pen would draw twice; 0: leave strokes as they are
    /// [default: a third of the width of the thinnest pen, whose ink covers such a gap]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub merge: Option<f64>,
    /// Search about so long for a good order of strokes, counted in work, so that the same one is found on every machine; 0: take the
    /// first one, each time on to a near stroke
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, allow_negative_numbers = true)]
    pub optimize: f64,
    /// What is to become small between strokes: time (the plotter's lifts and its travel with acceleration), or distance
    #[arg(long, value_name = "WHAT", default_value = "time")]
    pub order_by: String,
    /// Decides where the search tries something else; each number gives another order, about as good
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    pub order_seed: u64,
    /// Write curves as arcs, G2 and G3, where the plotter takes them: off, auto (in files, and on the line to Marlin, which has checksums), or on (on
    /// the line to GRBL too, where a byte that is changed may draw another arc unnoticed)
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = Arcs::Auto, hide_possible_values = true)]
    pub arcs: Arcs,
}

/// Whether nothing is said of a drawing and of the path of the pen, so that all is as it is by default. How arcs are written is no such thing: those
/// of a job that goes to a plotter as it is have a way of their own.
#[must_use]
pub fn say_nothing(drawing: &DrawingArgs, path: &PathArgs) -> bool {
    #[derive(Parser)]
    struct Unsaid {
        #[command(flatten)]
        drawing: DrawingArgs,
        #[command(flatten)]
        path: PathArgs,
    }
    let path = PathArgs { arcs: Arcs::default(), ..path.clone() };
    Unsaid::try_parse_from(["penvis"]).is_ok_and(|unsaid| unsaid.drawing == *drawing && unsaid.path == path)
}
