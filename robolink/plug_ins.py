"""What installed packages bring: transports, controllers, methods, sensors, by entry points."""

from robolink.messages import tr


class PlugInError(Exception):
    """A plug-in cannot be used; its text says why. Whoever looks for it says what it is."""

    @property
    def origin(self) -> BaseException:
        """What Python said when it was loaded; else this error itself."""
        return self.__cause__ or self


def find_plug_in(group: str, name: str) -> object | None:
    """Return what a package brings under a name, ``None`` where none brings it.

    Args:
        group: The group of entry points.
        name: The name in it.

    Raises:
        PlugInError: It cannot be loaded, or several packages bring one: nobody may guess which
            of them drives a machine.
    """
    from importlib import metadata  # costs more than all that need it

    found = tuple(metadata.entry_points(group=group, name=name))
    if not found:
        return None
    # One that is installed twice (an editable copy beside a wheel) leads to the same place.
    if len(found) > 1 and len({entry.value for entry in found}) > 1:
        raise PlugInError(tr("several packages provide it"))
    try:
        return found[0].load()  # type: ignore[no-any-return]
    except (ImportError, AttributeError) as error:
        raise PlugInError(str(error)) from error
    except Exception as error:  # its module runs when it is loaded, and may do anything
        raise PlugInError(f"{type(error).__name__}: {error}") from error
