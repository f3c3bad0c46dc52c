//! Dimensions of a NetCDF file by what they are for, their coordinates, and variables with their dimensions in a wanted order.
//!
//! A dimension is found by its name, by the attribute `axis` of its coordinate, or by the name of that. Coordinates that fall, such as
//! levels of pressure, are reversed with everything along them.
//! Check: the readers of initial fields and of cross-planes, with files of several programs.

use super::netcdf_input::{NetcdfFile, own_name, presentable};
use super::units::{FASTEST_M_S, Quantity};
use ndarray::{ArrayD, Axis};

/// What a dimension is for: its name here, its letter in the attribute `axis`, and other names for it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Role {
    name: &'static str,
    axis: &'static str,
    /// Words between blanks.
    others: &'static str,
}

impl Role {
    fn is_named(self, name: &str) -> bool {
        let name = name.to_ascii_lowercase();
        name == self.name || self.others.split(' ').any(|other| other == name)
    }
}

/// Time, or the age of a wake.
pub(crate) const TIME: Role = Role {
    name: "time",
    axis: "T",
    others: "tau t age xtime",
};
/// Along the flight.
pub(crate) const X: Role = Role {
    name: "x",
    axis: "X",
    others: "x_face xc xf xh xm xt xu ni nip1 west_east west_east_stag",
};
/// Across the flight.
pub(crate) const Y: Role = Role {
    name: "y",
    axis: "Y",
    others: "y_face yc yf yh ym yt yv nj njp1 lateral south_north south_north_stag",
};
/// Up.
pub(crate) const Z: Role = Role {
    name: "z",
    axis: "Z",
    others: "z_face zc zf zh zm zn zt zw nk nkp1 height altitude zu zu_3d zw_3d bottom_top bottom_top_stag",
};

impl NetcdfFile {
    /// The dimension of `variable` that has a role: by its name, by the attribute `axis` of its coordinate, or by the name of that.
    fn find(&self, dims: &[&str], role: Role) -> Option<usize> {
        let by_name = dims.iter().position(|dim| role.is_named(dim));
        if by_name.is_some() {
            return by_name;
        }
        let by_axis = dims.iter().position(|dim| self.has_axis(dim, role.axis));
        if by_axis.is_some() {
            return by_axis;
        }
        dims.iter().position(|dim| {
            self.coordinate_name(dim)
                .is_some_and(|name| role.is_named(name))
        })
    }

    /// Whether the coordinate of a dimension has this attribute `axis`.
    fn has_axis(&self, dim: &str, axis: &str) -> bool {
        self.coordinate_name(dim)
            .and_then(|name| self.text(name, "axis"))
            .is_some_and(|own| own.eq_ignore_ascii_case(axis))
    }

    /// The variable with the positions of a dimension: that of its name, or one along it alone that is called as one or has the
    /// attribute `axis`.
    pub(crate) fn coordinate_name(&self, dim: &str) -> Option<&str> {
        if self.has(dim) {
            return self.variable(dim).map(own_name);
        }
        for variable in &self.variables {
            let is_along = matches!(&variable.dimensions[..], [only] if only.name == dim);
            let name = own_name(variable);
            let is_called = [TIME, X, Y, Z].iter().any(|role| role.is_named(name));
            if is_along && (is_called || self.text(name, "axis").is_some()) {
                return Some(name);
            }
        }
        None
    }

    /// The dimension of a variable that has a role, if there is one.
    pub(crate) fn dim_of(&self, name: &str, role: Role) -> Option<String> {
        let dims = self.dims(name)?;
        self.find(&dims, role).map(|place| dims[place].to_owned())
    }

    /// The dimensions of a variable that have these roles, in their order; dimensions of length 1 may be left over.
    ///
    /// # Errors
    /// What to rename.
    pub(crate) fn roles<const N: usize>(
        &self,
        name: &str,
        roles: [Role; N],
    ) -> Result<[String; N], String> {
        let needed = roles.each_ref().map(|role| role.name).join(", ");
        let Some(dims) = self.dims(name) else {
            return Err(format!(
                "it has no variable {name}: one over {needed} is needed"
            ));
        };
        let places: Vec<Option<usize>> = roles.iter().map(|role| self.find(&dims, *role)).collect();
        let spare: Vec<&str> = (0..dims.len())
            .filter(|i| !places.contains(&Some(*i)))
            .map(|i| dims[i])
            .collect();
        let found: Vec<String> = places
            .iter()
            .flatten()
            .map(|place| dims[*place].to_owned())
            .collect();
        if let Some(missing) = places.iter().position(Option::is_none) {
            let role = roles[missing];
            let count = dims.len();
            let known = spare.iter().find_map(|dim| presentable(dim));
            let rename = known.map_or(String::new(), |dim| {
                format!(
                    ": rename {dim}, in xarray with ds.rename({dim}=\"{}\"), or",
                    role.name
                )
            });
            return Err(format!(
                "{name} needs dimensions for {needed} (in any order), and none of its {count} is {}{rename} give its coordinate the attribute \
                 axis = \"{}\"",
                role.name, role.axis
            ));
        }
        if let Some(long) = spare.iter().find(|dim| self.length(dim) != Some(1)) {
            let which = presentable(long).unwrap_or("dimension");
            return Err(format!(
                "{name} has a further {which} of more than one value: select one of them first"
            ));
        }
        found
            .try_into()
            .map_err(|_| format!("{name} has one dimension for two of its axes"))
    }

    /// Length of a dimension.
    pub(crate) fn length(&self, dim: &str) -> Option<u64> {
        let all = self
            .variables
            .iter()
            .flat_map(|variable| &variable.dimensions);
        all.filter(|own| own.name == dim).map(|own| own.size).next()
    }

    /// The coordinate of a dimension, from the lowest on where it falls.
    ///
    /// # Errors
    /// There is none, or it has another length.
    pub(crate) fn coordinate(&self, dim: &str) -> Result<Vec<f64>, String> {
        let shown = presentable(dim).unwrap_or("a dimension").to_owned();
        let Some(name) = self.coordinate_name(dim) else {
            return Err(format!(
                "{shown} has no coordinate: a variable of that name with its positions is needed"
            ));
        };
        let mut values = self
            .floats(name)
            .map_err(|_| format!("the coordinate of {shown} cannot be read"))?;
        if self.length(dim) != Some(values.len() as u64) {
            return Err(format!(
                "the coordinate of {shown} does not have the length of its dimension"
            ));
        }
        if falls(&values) {
            values.reverse();
        }
        Ok(values)
    }

    /// Whether the positions of a dimension fall, so that what runs along it is turned round; times are not.
    fn is_turned(&self, dim: &str) -> bool {
        let name = self.coordinate_name(dim).unwrap_or(dim);
        let is_time = TIME.is_named(dim) || TIME.is_named(name);
        !is_time && self.floats(name).is_ok_and(|values| falls(&values))
    }

    /// The coordinate of a dimension in metres.
    ///
    /// # Errors
    /// As [`Self::coordinate`]; a unit that is no length.
    pub(crate) fn coordinate_m(&self, dim: &str) -> Result<Vec<f64>, String> {
        let name = self.coordinate_name(dim).unwrap_or(dim);
        let unit_m = self.unit(name, Quantity::Length)?;
        Ok(self
            .coordinate(dim)?
            .into_iter()
            .map(|value| value * unit_m)
            .collect())
    }

    /// Whether a variable holds minutes without saying so in its unit, as XTIME does in files of WRF before 3.8.
    pub(crate) fn has_plain_minutes(&self, name: &str) -> bool {
        let units = self.text(name, "units").unwrap_or_default();
        name.eq_ignore_ascii_case("XTIME") && units.trim().is_empty()
    }

    /// Times in seconds, from the unit of a variable; a date from which they count is ignored.
    ///
    /// # Errors
    /// As [`Self::floats`]; a unit that is no time.
    pub(crate) fn seconds(&self, name: &str) -> Result<Vec<f64>, String> {
        let unit_s = match self.text(name, "units") {
            _ if self.has_plain_minutes(name) => 60.0,
            // Plain numbers are taken for seconds.
            Some("1") => 1.0,
            _ => self.unit(name, Quantity::Time)?,
        };
        Ok(self
            .floats(name)?
            .into_iter()
            .map(|value| value * unit_s)
            .collect())
    }

    /// Velocities in m/s with their dimensions in this order, as [`Self::ordered`]; NaN where one is as large as no wind, as fill values
    /// are that no attribute names.
    ///
    /// # Errors
    /// As there; a unit that is no velocity.
    pub(crate) fn velocities(
        &self,
        name: &str,
        order: &[String],
        place: Option<usize>,
    ) -> Result<Vec<f64>, String> {
        let unit_m_s = self.unit(name, Quantity::Velocity)?;
        Ok(self
            .ordered(name, order, place)?
            .into_iter()
            .map(|value| value * unit_m_s)
            .map(|value| match value.abs() < FASTEST_M_S {
                true => value,
                false => f64::NAN,
            })
            .collect())
    }

    /// Values of a variable with its dimensions in this order, the last one fastest: all, or those of one place of the slowest dimension,
    /// which `order` then leaves out.
    ///
    /// # Errors
    /// As [`Self::floats`].
    pub(crate) fn ordered(
        &self,
        name: &str,
        order: &[String],
        place: Option<usize>,
    ) -> Result<Vec<f64>, String> {
        let mut dims = self.dims(name).unwrap_or_default();
        if place.is_some() && !dims.is_empty() {
            dims.remove(0);
        }
        let values = match place {
            Some(place) => self.part(
                name,
                std::slice::from_ref(&(place as u64..place as u64 + 1)),
            )?,
            None => self.floats(name)?,
        };
        let turned: Vec<usize> = (0..dims.len())
            .filter(|at| self.is_turned(dims[*at]))
            .collect();
        if dims == order && turned.is_empty() {
            return Ok(values);
        }
        let lengths: Vec<usize> = dims
            .iter()
            .map(|dim| self.length(dim).unwrap_or(1) as usize)
            .collect();
        // What is left over has one place.
        let mut axes = Vec::new();
        let mut spare = Vec::new();
        for (axis, dim) in dims.iter().enumerate() {
            match order.iter().any(|own| own == dim) {
                true => axes.push(axis),
                false => spare.push(axis),
            }
        }
        axes.sort_by_key(|at| order.iter().position(|own| own == dims[*at]));
        axes.extend(spare);
        let mut stored = ArrayD::from_shape_vec(lengths, values)
            .map_err(|_| format!("{name} does not have the lengths of its dimensions"))?;
        for at in turned {
            stored.invert_axis(Axis(at));
        }
        Ok(stored.permuted_axes(axes).iter().copied().collect())
    }
}

/// Whether numbers fall from each to the next.
fn falls(values: &[f64]) -> bool {
    values.len() > 1 && values.windows(2).all(|pair| pair[1] < pair[0])
}
