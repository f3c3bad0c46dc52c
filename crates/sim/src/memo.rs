//! Values that several scenes share, each computed once: known by the hash of what they depend on.

use crate::Error;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Values by the hash of what they depend on.
#[derive(Debug)]
pub(crate) struct Memo<T>(Mutex<HashMap<String, Arc<T>>>);

impl<T> Default for Memo<T> {
    fn default() -> Self {
        Self(Mutex::new(HashMap::new()))
    }
}

impl<T> Memo<T> {
    /// The value of a cause, made if it is not known; one at a time.
    ///
    /// # Errors
    /// Those of `make`.
    pub(crate) fn of(
        &self,
        cause: String,
        make: impl FnOnce() -> Result<T, Error>,
    ) -> Result<Arc<T>, Error> {
        // A value that could not be made left nothing behind.
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = known.get(&cause) {
            return Ok(Arc::clone(value));
        }
        let made = Arc::new(make()?);
        known.insert(cause, Arc::clone(&made));
        Ok(made)
    }

    /// How many were made.
    pub(crate) fn len(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).len()
    }
}
