//! `penvis console` with a script, at simulated plotters of each language.

use std::io::Write;
use std::process::{Command, Stdio};

/// What a script at a port is answered: the lines of the output without their times.
fn talk(port: &str, script: &str) -> Vec<String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penvis"));
    command.args(["console", "--port", port]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{port}: {said}");
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.trim_start().split_once(' ').unwrap().1.to_owned()).collect()
}

#[test]
fn each_line_of_a_script_is_answered_before_the_next_goes_out() {
    let hpgl = talk("sim:hpgl7475a", "IN;SP1;PA100,50;PD;\nOA;\n^[.B\nQQ;OE;\nOI;\n");
    assert_eq!(
        hpgl,
        ["> IN;SP1;PA100,50;PD;", "> OA;", "< 100,50,1", "> ^[.B", "< 1024", "> QQ;OE;", "< 1", "> OI;", "< 7475A"]
    );
    let grbl = talk("sim:grbl", "G0 X1\nG4 P0.1\n?\nG0 X\n");
    assert_eq!(grbl[0], "< Grbl 1.1h ['$' for help]");
    assert_eq!(grbl[1..5], ["> G0 X1", "< ok", "> G4 P0.1", "< ok"]);
    assert!(grbl[5] == "> ?" && grbl[6].starts_with("< <Idle|MPos:1.000,0.000,0.000"), "{grbl:?}");
    assert_eq!(grbl[7..], ["> G0 X", "< error:2"]);
    let marlin = talk("sim:marlin", "G0 X1 F6000\nM114\n");
    let asked = marlin.iter().position(|line| line == "> G0 X1 F6000").unwrap();
    assert_eq!(marlin[asked + 1..asked + 3], ["< ok", "> M114"]);
    assert!(marlin[asked + 3].starts_with("< X:1.00 Y:0.00"), "{marlin:?}");
}
