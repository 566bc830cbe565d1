//! Exact constructors.
