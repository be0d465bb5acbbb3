"""The panel's tests. Those in a real browser run where they are named: ``make panel``."""


def pytest_ignore_collect(collection_path, config):
    """Leave the browser's tests to a process of their own."""
    named = any("browser" in str(word) for word in config.invocation_params.args)
    return True if collection_path.name == "browser" and not named else None
