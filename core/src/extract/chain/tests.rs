//! Counts of chains against closed forms.
