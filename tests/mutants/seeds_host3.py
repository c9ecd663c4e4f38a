"""Seeded bugs of failures of the system that nobody had tried: a zero of other devices, an upgrade at any
moment, what is asked for again."""

from __future__ import annotations

from seed import Seed

WITHOUT_HOST = "tests/unit/rt/test_process_without_host.py"
ZERO = "tests/unit/host/test_force_zero.py::test_a_zero_of_other_devices_judges_too_and_is_said_to_be_one"
HOME = "tests/unit/test_user_folders.py::test_a_folder_that_depends_on_the_working_directory_is_none"
CTRL_C = "tests/unit/cli/test_last_words.py::test_ctrl_c_never_ends_it_by_the_signal_itself"
FILE = "rtctl/host/exchange/force_zero.py"

SEEDS = (
    Seed(
        "a zero of other devices says nothing, and the first one passes unjudged",
        FILE,
        "self._take_up(kept)\n",
        "self._take_up({} if self._others else kept)\n",
        (ZERO,),
    ),
    Seed(
        "a zero that was accepted stays one of other devices",
        FILE,
        "            self._others = False\n",
        "",
        (ZERO,),
    ),
    Seed(
        "an experiment that is resumed does not know what was reported",
        "rtctl/experiments/kept_runs.py",
        "if not (resume and there.exists()):",
        "if True:",
        (
            "tests/unit/experiments/test_kept_runs.py::"
            "test_what_was_reported_is_where_a_start_with_resume_begins_and_another_one_does_not",
        ),
    ),
    Seed(
        "Ctrl-C while the program is imported ends it by the signal",
        "rtctl/__main__.py",
        "        os._exit(128 + number)",
        "        signal.signal(number, signal.SIG_DFL), os.kill(os.getpid(), number)",
        (
            "tests/unit/cli/test_last_words.py::test_a_signal_while_the_program_is_imported_ends_it_with_a_line",
        ),
    ),
    Seed(
        "Ctrl-C while the interpreter is taken apart ends it by the signal",
        "rtctl/cli/__init__.py",
        "    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)\n",
        "",
        (CTRL_C,),
    ),
    Seed(
        "a program whose files were replaced while it was imported shows a traceback",
        "rtctl/cli/__init__.py",
        "if not installed_anew():",
        "if True:",
        ("tests/unit/cli/test_last_words.py::test_a_program_whose_files_were_replaced_says_so",),
    ),
    Seed(
        "the memory of host and loop can be cut by whoever runs as the same user",
        "rtctl/rt/shared_memory.py",
        "fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL",
        "fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL",
        ("tests/unit/test_shm.py::test_nobody_makes_it_smaller_or_larger",),
    ),
    Seed(
        "threads that are refused are found out by ZeroMQ, which ends the process without a name",
        "rtctl/host/waiting_loop.py",
        "    except RuntimeError as error:\n",
        "    except MemoryError as error:\n",
        (
            "tests/unit/host/test_few_tasks.py::test_threads_that_are_refused_are_named_and_those_that_were_begun_end",
        ),
    ),
    Seed(
        "a loop process that the machine refuses is not named",
        "rtctl/host/waiting_loop.py",
        "except OSError as error:  # EAGAIN",
        "except EOFError as error:  # EAGAIN",
        (
            "tests/unit/host/test_few_tasks.py::test_a_loop_process_that_cannot_be_started_is_named_and_leaves_nothing",
        ),
    ),
    Seed(
        "a relative XDG folder keeps a rig's zero and lock in the working directory",
        "hw/outside.py",
        "return told if told.is_absolute() else home()",
        "return told.absolute() if str(told) != '.' else home()",
        (HOME,),
    ),
    Seed(
        "a relative HOME is a home",
        "hw/outside.py",
        "    if told.is_absolute():\n        return told\n    try",
        "    if str(told) != '.':\n        return told\n    try",
        (HOME,),
    ),
    Seed(
        "a loop whose host is gone compiles on",
        "rtctl/rt/process.py",
        "        if os.getppid() != host:\n            os._exit(1)",
        "        pass",
        (WITHOUT_HOST,),
    ),
    Seed(
        "a loop whose host is gone leaves its devices open",
        "rtctl/rt/process.py",
        "    code_cache.on_compiled.remove(leave)",
        "    pass",
        (WITHOUT_HOST,),
    ),
)
