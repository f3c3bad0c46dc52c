//! Values that several scenes share, each computed once: identified by what they depend on.

use crate::Error;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Values by what they depend on.
#[derive(Debug)]
pub(crate) struct Memo<T>(Mutex<HashMap<String, Arc<T>>>);

impl<T> Default for Memo<T> {
    fn default() -> Self {
        Self(Mutex::new(HashMap::new()))
    }
}

impl<T> Memo<T> {
    /// The value of a key, made if there is none yet; one at a time.
    ///
    /// # Errors
    /// Fails if `make` fails.
    pub(crate) fn get_or_make(
        &self,
        key: String,
        make: impl FnOnce() -> Result<T, Error>,
    ) -> Result<Arc<T>, Error> {
        // A value that could not be made left nothing behind.
        let mut values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = values.get(&key) {
            return Ok(Arc::clone(value));
        }
        let made = Arc::new(make()?);
        values.insert(key, Arc::clone(&made));
        Ok(made)
    }

    /// Number of values that were made.
    pub(crate) fn len(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).len()
    }
}
