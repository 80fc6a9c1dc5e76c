//! Whole recordings: written, read back, cut, garbled.

mod damage;
mod foreign;
mod pullally;
mod round_trip;
mod synthetic;
mod wires;
