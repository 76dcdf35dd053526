"""Marks of tests that read what lies beside the checkout, in ``../shared``, and skip where it is absent."""

import pytest

from tests.assets import SHARED

OBJECTS = SHARED / "partnet_mobility"
needs_objects = pytest.mark.skipif(not OBJECTS.is_dir(), reason="../shared/partnet_mobility is absent")
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason="../shared is absent")
