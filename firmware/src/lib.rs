//! Pen plotter firmware.
#![no_std]
