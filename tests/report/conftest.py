import pytest

from tests.assessment.test_assessment import assessment as assessment  # a fixture


@pytest.fixture(scope="session")
def report(assessment):
    return assessment.report(title="A <b>scene</b> & its noise")
