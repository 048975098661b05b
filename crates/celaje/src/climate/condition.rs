//! One value in force, with its reason.

/// One value in force: what it is, where it comes from and why.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Condition<T> {
    /// The value, in `unit`.
    pub value: T,
    /// Unit, empty for a pure number or a name.
    pub unit: &'static str,
    /// Standard deviation about the value, in `unit`, where known.
    pub uncertainty: Option<f64>,
    /// Data or method that the value comes from.
    pub source: String,
    /// Why this value, in words for people.
    pub reason: String,
}

impl<T> Condition<T> {
    /// A value with its unit, source and reason.
    pub fn new(
        value: T,
        unit: &'static str,
        source: impl Into<String>,
        reason: impl Into<String>,
    ) -> Self {
        Self {
            value,
            unit,
            uncertainty: None,
            source: source.into(),
            reason: reason.into(),
        }
    }

    /// The same with a standard deviation, in its unit.
    pub fn with_uncertainty(mut self, uncertainty: f64) -> Self {
        self.uncertainty = Some(uncertainty);
        self
    }

    /// The same of another kind of value.
    pub(super) fn map<U>(self, kind: impl FnOnce(T) -> U) -> Condition<U> {
        Condition {
            value: kind(self.value),
            unit: self.unit,
            uncertainty: self.uncertainty,
            source: self.source,
            reason: self.reason,
        }
    }

    /// A value that the user gave.
    pub fn given(value: T, unit: &'static str) -> Self {
        Self::new(value, unit, "user", "given by the user")
    }

    /// The user's value if there is one, what was found otherwise.
    pub(super) fn or_found(
        given: Option<T>,
        unit: &'static str,
        found: impl FnOnce() -> Self,
    ) -> Self {
        given.map_or_else(found, |value| Self::given(value, unit))
    }
}
