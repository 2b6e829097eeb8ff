//! What a command shows of its outcome: the picture, the page, the map on a terminal.

use super::page;
use super::picture::{Subject, braille, picture, png};
use super::run::Run;
use crate::fence::FenceSet;
use crate::geodesy::ProjectionError;
use crate::replan::{Field, Replanned, Verdict};

/// An outcome, for pictures and pages.
#[derive(Debug, Clone, Copy)]
pub struct Report<'a> {
    /// What it is called: free text.
    pub title: &'a str,
    /// The command with its files, such as `plan city.plan`, to be run again.
    pub command: Option<&'a str>,
    /// The verdict on the original mission.
    pub before: &'a Verdict,
    /// The plan, where there is one.
    pub planned: Option<&'a Replanned>,
    /// Why there is none, where one was asked for.
    pub reason: Option<&'a str>,
    /// The zones of a mission without a plan.
    pub fields: &'a [Field],
    /// The fences, for their names.
    pub fences: &'a FenceSet,
    /// The circumstances.
    pub run: Run<'a>,
}

/// Why there is no picture or page.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A place of the mission cannot be projected into the drawn zone.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
    /// The picture cannot be drawn in pixels.
    #[error("the picture cannot be made: {0}; write it as .svg")]
    Png(String),
}

impl<'a> Report<'a> {
    /// The report of a mission that was planned.
    #[must_use]
    pub fn planned(
        planned: &'a Replanned,
        run: Run<'a>,
        title: &'a str,
        fences: &'a FenceSet,
    ) -> Self {
        let (before, fields) = (&planned.before, planned.fields.as_slice());
        let planned = Some(planned);
        Self { title, command: None, before, planned, reason: None, fields, fences, run }
    }

    /// The report of a mission that was only judged, or for which there is no plan.
    #[must_use]
    pub fn judged(
        before: &'a Verdict,
        fields: &'a [Field],
        run: Run<'a>,
        title: &'a str,
        fences: &'a FenceSet,
    ) -> Self {
        Self { title, command: None, before, planned: None, reason: None, fields, fences, run }
    }

    pub(super) fn subject(&self) -> Subject<'a> {
        match self.planned {
            Some(planned) => planned.into(),
            None => Subject::judged(self.before, self.fields),
        }
    }

    /// The map as SVG.
    ///
    /// # Errors
    /// [`ReportError::Projection`].
    pub fn svg(&self) -> Result<String, ReportError> {
        Ok(picture(self.subject(), &self.run, self.title)?)
    }

    /// The same in pixels, as PNG.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        png(&self.svg()?).map_err(ReportError::Png)
    }

    /// The map for a terminal of 80 columns, with colours where it has them.
    ///
    /// # Errors
    /// [`ReportError::Projection`].
    pub fn terminal(&self, colours: bool) -> Result<String, ReportError> {
        Ok(braille(&self.subject(), colours)?)
    }

    /// The page, as HTML.
    ///
    /// # Errors
    /// [`ReportError::Projection`].
    pub fn html(&self) -> Result<String, ReportError> {
        Ok(page::page(self)?)
    }
}
