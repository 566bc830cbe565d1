//! The time that is said before a plot against the virtual time that the simulated plotter then takes.

use penvis::device::{self, Device, Language};
use penvis::drawing::Drawing;
use penvis::emit;
use penvis::estimate::Estimate;
use penvis::protocol;
use penvis::sim::{SimName, SimPort};
use penvis::stream::{self, Clock};
use penvis::trace;
use penvis_tests::plotter::{Nobody, draw};

/// Part by which the time said may differ from the time taken.
const ALLOWED: f64 = 0.01;

fn job(drawing: &Drawing, device: &Device) -> String {
    match device.language {
        Language::Hpgl(_) => emit::hpgl(drawing, device).expect("HPGL"),
        _ => emit::gcode(drawing, device).expect("G-code"),
    }
}

/// Virtual time in s from switching the plotter on to the end of the job.
fn taken(job: &str, device: &Device, name: &str) -> f64 {
    let name = SimName::parse(name).expect("a simulated port").expect("its options are legal");
    let mut port = SimPort::with(name.peer(device).expect("a peer"), device.baud);
    let clock = port.clock();
    let mut conversation = protocol::start(job.as_bytes(), device, device.baud).expect("a job for the device");
    stream::run(&mut port, conversation.protocol.as_mut(), &clock, &mut Nobody).expect("plotted to the end");
    clock.now().as_secs_f64()
}

/// The time that the program says remains when the job begins.
fn said_of_job(job: &str, device: &Device) -> f64 {
    match &device.language {
        Language::Hpgl(language) => {
            let job = protocol::hpgl::Job::new(job.as_bytes()).expect("a job");
            trace::hpgl::follow(&job, device, language).seconds()
        }
        Language::Grbl(gcode) | Language::Marlin(gcode) => {
            let job = protocol::grbl::Job::new(job, gcode.line_limit).expect("a job");
            let machine = trace::gcode::Machine::new(device, gcode);
            trace::gcode::follow(&job, &machine, &trace::gcode::Modal::after_reset(), trace::Position::UNKNOWN)
                .trace
                .seconds()
        }
    }
}

fn holds(words: &[&str], device: &str, port: &str) {
    let device = device::find(device).expect("a built-in profile");
    let drawing = draw(words).drawing;
    let empty = Drawing { polylines: Vec::new(), ..drawing.clone() };
    // Greeting, probing and waiting for the end take their time with an empty sheet too.
    let time = |drawing: &Drawing| taken(&job(drawing, &device), &device, port);
    let taken = time(&drawing) - time(&empty);
    let said = Estimate::new(&drawing, &device).seconds();
    let remaining = said_of_job(&job(&drawing, &device), &device) - said_of_job(&job(&empty, &device), &device);
    println!("{words:?} on {port}: {taken:.2} s, said before {said:.2} s, said of the job {remaining:.2} s");
    for said in [said, remaining] {
        assert!((said - taken).abs() <= ALLOWED * taken, "{words:?} on {port}: {said:.2} s said, {taken:.2} s taken");
    }
}

#[test]
fn plots_by_the_firmware_take_the_time_that_is_said() {
    for model in ["saddle", "torus", "pawn", "teapot"] {
        holds(&[model], "penvis", "sim");
    }
}

#[test]
fn pictures_that_the_line_is_too_slow_for_take_the_time_that_is_said() {
    // Chords of a few hundredths of a millimetre.
    holds(&["sphere", "--tolerance", "0.0005", "--iso", "24"], "penvis", "sim");
}

#[test]
fn plots_on_an_hp_take_the_time_that_is_said() {
    // The last with a change of pens.
    for words in [&["saddle"][..], &["pawn"], &["teapot"], &["torus", "--hidden", "layer"]] {
        holds(words, "hp7475a", "sim:hpgl7475a");
    }
}
