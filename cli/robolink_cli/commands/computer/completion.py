"""completion SHELL: the script that makes TAB work."""

from typing import Final

import click

from robolink.messages import tr

_UNQUOTED: Final = "COMPREPLY+=($value)"
_QUOTED: Final = 'COMPREPLY+=("$(printf %q "$value")")'
"""Replacement for click's bash script, which does not quote names: a name with a blank would become
two words, and one with a star would expand to files.
"""


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish", "powershell"]))
def completion(shell: str) -> None:
    r"""Print the script for TAB completion of commands, options and cells.

    \b
    bash        echo 'eval "$(robolink expert completion bash)"' >> ~/.bashrc
    zsh         echo 'eval "$(robolink expert completion zsh)"' >> ~/.zshrc
    fish        robolink expert completion fish > ~/.config/fish/completions/robolink.fish
    powershell  robolink expert completion powershell | Out-String | Invoke-Expression
    """
    from click.shell_completion import get_completion_class

    from robolink.errors import ConfigError

    made = get_completion_class(shell)
    if made is None:
        raise ConfigError(
            tr("The click installed here has no completion for {shell}.", shell=shell),
            remedy=tr("Install click 8.5 or later."),
        )
    root = click.get_current_context().find_root().command
    script = made(root, {}, "robolink", "_ROBOLINK_COMPLETE").source()
    click.echo(script.replace(_UNQUOTED, _QUOTED) if shell == "bash" else script)
