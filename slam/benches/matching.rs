//! Time per sweep.
fn main() {
    divan::main();
}
