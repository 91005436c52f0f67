//! What a family was made into before.

use std::fmt;
use std::sync::Arc;

use nonsmooth_scenes::Scene;
use nonsmooth_solve::settings::SettingsMap;

/// A scene that was made already, kept beside what it was made of and used only where that is still the same: a large pile takes many seconds. It is no part of
/// the document, so it is neither written nor compared.
#[derive(Clone, Default)]
pub struct Made(Option<Arc<(String, SettingsMap, Scene)>>);

impl Made {
    /// The scene that a family makes of these settings.
    pub fn of(family: &str, set: &SettingsMap, scene: Scene) -> Self {
        Self(Some(Arc::new((family.into(), set.clone(), scene))))
    }

    /// The scene, if it is that of this family with these settings.
    pub(super) fn scene(&self, family: &str, set: &SettingsMap) -> Option<&Scene> {
        let (own, with, scene) = self.0.as_deref()?;
        (own == family && with == set).then_some(scene)
    }
}

impl PartialEq for Made {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl fmt::Debug for Made {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_tuple("Made").field(&self.0.as_deref().map(|(family, ..)| family)).finish()
    }
}
