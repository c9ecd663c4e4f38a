"""`rtctl completion`: what a shell needs to complete commands, options, rig names and shipped rig files."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(ctx: click.Context, shell: str) -> None:
    """Print the completion of rtctl for SHELL.

    \b
    bash, in ~/.bashrc:                     eval "$(rtctl completion bash)"
    zsh, in ~/.zshrc:                       eval "$(rtctl completion zsh)"
    fish, in ~/.config/fish/config.fish:    rtctl completion fish | source"""
    made = get_completion_class(shell)
    assert made is not None
    # by the fixed name, not by how it was called: the shell completes after `rtctl`
    click.echo(made(ctx.find_root().command, {}, "rtctl", "_RTCTL_COMPLETE").source())
