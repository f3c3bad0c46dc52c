//! The wake in space: surfaces of equal vorticity at the ages of its fields, and the frames of a cross-plane.

use super::finished::FinishedWake;
use crate::Error;
use crate::io::fields_input::{FieldPlace, read_scalar};
use crate::io::{CrossPlanes, planes_input};
use crate::plot::{Cells, ColourMap, Figure, IsosurfacePlot, MapPlot, Surface, Volume};
use wakescope_les::winds::VolumeComponent;

/// Times that the box is repeated along the flight, so that waves can be seen as such.
pub const REPEATS: usize = 2;

impl FinishedWake {
    /// Surfaces where the vorticity, over `Gamma0/b0^2`, is 1 and 10, at the ages of the fields; none without fields as NetCDF.
    ///
    /// # Errors
    /// Fields that cannot be read.
    pub fn surfaces_figure(&self) -> Result<Option<Figure>, Error> {
        let mut panels = Vec::new();
        for (index, tau) in self.fields_tau.iter().enumerate() {
            let path = self.folder.join(format!("fields_{:04}.nc", index + 1));
            if !path.exists() {
                return Ok(None);
            }
            let place = FieldPlace { path, place: Some(0), time_s: 0.0 };
            let VolumeComponent { nodes_m: [x, y, z], values } = read_scalar(&place, "vorticity_magnitude")?;
            let scales = self.flow.pair.scales().map_err(Error::Flow)?;
            let unit_per_s = scales.circulation_m2_s / scales.spacing_m.powi(2);
            let length = self.flow.size[0];
            let nx = x.len();
            let repeated =
                (0..REPEATS * nx + 1).map(|i| x[i % nx] / scales.spacing_m + (i / nx) as f64 * length).collect();
            let rows = values.chunks(nx);
            let values =
                rows.flat_map(|row| (0..REPEATS * nx + 1).map(|i| (row[i % nx] / unit_per_s) as f32)).collect();
            let in_b0 = |axis: Vec<f64>| axis.into_iter().map(|a| a / scales.spacing_m).collect();
            let volume = Volume::new([repeated, in_b0(y), in_b0(z)], values)?;
            let surface = |level: f64, colour, opacity| Surface { level, colour, opacity };
            panels.push(IsosurfacePlot {
                title: format!("τ = {tau}"),
                volume,
                surfaces: vec![surface(1.0, [120, 170, 215], 0.35), surface(10.0, [200, 60, 40], 1.0)],
                view_rad: [-0.55, 0.35],
            });
        }
        if panels.is_empty() {
            return Ok(None);
        }
        let mut figure = Figure::stacked(panels);
        (figure.columns, figure.width) = (2, 1200.0);
        Ok(Some(figure))
    }

    /// Axial vorticity of the first cross-plane over time, over `Gamma0/b0^2`; empty without planes as NetCDF.
    ///
    /// # Errors
    /// Planes that cannot be read.
    pub fn frames(&self) -> Result<Vec<Figure>, Error> {
        let name = self.folder.join("plane1");
        if !self.folder.join("plane1_0001.nc").exists() {
            return Ok(Vec::new());
        }
        let scales = self.flow.pair.scales().map_err(Error::Flow)?;
        let unit_per_s = scales.circulation_m2_s / scales.spacing_m.powi(2);
        let mut frames: Vec<(f64, Figure)> = Vec::new();
        for path in planes_input::files(&name)? {
            let planes = planes_input::read(&path)?;
            for (place, tau) in planes.tau.iter().enumerate() {
                let vorticity = axial_vorticity_per_s(&planes, place).into_iter().map(|w| w / unit_per_s).collect();
                let cells = Cells::of_plane(&planes.y_m, &planes.z_m, vorticity);
                let map = MapPlot::of_cells(cells, "ω_{x} b₀²/Γ₀", true)
                    .coloured(ColourMap::Diverging { limit: 10.0 })
                    .titled(&format!("τ = {tau:.1}"));
                let mut figure = Figure::stacked([map]);
                figure.width = 640.0;
                frames.push((*tau, figure));
            }
        }
        frames.sort_by(|a, b| a.0.total_cmp(&b.0));
        frames.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
        Ok(frames.into_iter().map(|f| f.1).collect())
    }
}

/// `dw/dy - dv/dz` by differences over the neighbours, `[z][y]` \[1/s\].
fn axial_vorticity_per_s(planes: &CrossPlanes, place: usize) -> Vec<f64> {
    let (ny, nz) = (planes.y_m.len(), planes.z_m.len());
    let mut out = Vec::with_capacity(ny * nz);
    for k in 0..nz {
        let (low, high) = (k.saturating_sub(1), (k + 1).min(nz - 1));
        for j in 0..ny {
            let (left, right) = (j.saturating_sub(1), (j + 1).min(ny - 1));
            let dw = planes.w_m_s[[place, k, right]] - planes.w_m_s[[place, k, left]];
            let dv = planes.v_m_s[[place, high, j]] - planes.v_m_s[[place, low, j]];
            out.push(dw / (planes.y_m[right] - planes.y_m[left]) - dv / (planes.z_m[high] - planes.z_m[low]));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Silent;
    use crate::flow::{Begin, CaseFile, CaseKind, WakePreset, run};
    use crate::io::fields_input::places;
    use std::path::Path;

    #[test]
    fn fields_and_planes_of_a_run_come_back() {
        let mut case = WakePreset::Coarse.case();
        let CaseKind::Wake(wake) = &mut case.case else { panic!("a wake") };
        wake.cells = [4, 16, 12];
        if let Some(output) = &mut case.wake {
            output.end_tau = 0.02;
            output.fields_tau = Some(vec![0.02]);
            output.planes_tau = Some(vec![0.0, 0.02]);
        }
        let file = CaseFile::parse(&toml::to_string(&case).unwrap(), Path::new("case.toml")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let outcome = run(&file, folder.path(), Begin::New, &Silent).unwrap();
        let path = folder.path().join("fields_0001.nc");
        let [place] = &places(&path, "vorticity_magnitude").unwrap()[..] else { panic!("one time") };
        let field = read_scalar(place, "vorticity_magnitude").unwrap();
        assert_eq!(field.nodes_m.each_ref().map(Vec::len), [4, 16, 12]);
        assert!((place.time_s - outcome.time_s).abs() < 1e-9);
        // The core turns by Gamma0/(pi r_c^2) at its centre; three cells see part of it.
        let largest = field.values.iter().copied().fold(0.0, f64::max);
        let core_per_s = 500.0 / (std::f64::consts::PI * 4.7_f64.powi(2));
        assert!(largest > 0.05 * core_per_s && largest < 3.0 * core_per_s, "{largest} of {core_per_s}");
        let planes = planes_input::files(&folder.path().join("plane1")).unwrap();
        assert_eq!(planes.iter().map(|path| planes_input::read(path).unwrap().tau.len()).sum::<usize>(), 2);
        assert!(read_scalar(place, "nothing").unwrap_err().to_string().contains("nothing"));
        assert!(planes_input::files(&folder.path().join("plane7")).is_err());
    }
}
