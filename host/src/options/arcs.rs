//! Whether curves are written as arcs.

use crate::device::{Device, Language};

/// Whether curves are written as arcs, G2 and G3, where the device takes them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Arcs {
    /// In files, and on the line to plotters whose lines have checksums.
    #[default]
    Auto,
    /// Never: as lines only.
    Off,
    /// On the line to all plotters too.
    On,
}

impl Arcs {
    /// Whether there are arcs in a file for a device.
    #[must_use]
    pub fn in_file(self, device: &Device) -> bool {
        self != Self::Off && device.language.gcode().is_some_and(|gcode| gcode.arcs)
    }

    /// Whether arcs go over the line to a device. GRBL has no checksums: G2 that arrives as G3 ends where it should, so that nothing shows that another
    /// curve was drawn, and only the user can know that the line is good enough for it.
    #[must_use]
    pub fn on_line(self, device: &Device) -> bool {
        self.in_file(device) && (self == Self::On || matches!(device.language, Language::Marlin(_)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::find;

    #[test]
    fn arcs_go_where_nothing_changes_them_unnoticed() {
        let table = [
            ("grbl-servo", Arcs::Auto, true, false),
            ("grbl-servo", Arcs::Off, false, false),
            ("penvis", Arcs::On, true, true),
            ("marlin-z", Arcs::Auto, true, true),
            ("marlin-z", Arcs::Off, false, false),
            ("hp7475a", Arcs::On, false, false),
        ];
        for (name, arcs, in_file, on_line) in table {
            let device = find(name).unwrap();
            assert_eq!((arcs.in_file(&device), arcs.on_line(&device)), (in_file, on_line), "{name} {arcs:?}");
        }
        let mut none = find("marlin-servo").unwrap();
        if let Language::Marlin(gcode) = &mut none.language {
            gcode.arcs = false;
        }
        assert!(!Arcs::On.in_file(&none) && !Arcs::On.on_line(&none));
    }
}
