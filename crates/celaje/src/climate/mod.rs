//! Place + time → conditions, each value with its reason.
