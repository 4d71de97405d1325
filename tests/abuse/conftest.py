from functools import cache

import pytest

from tests.abuse.commands import COMMANDS, Written, ended, prepare, tree


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Files that a command writes without a disturbance."""

    @cache
    def files(name: str) -> dict[str, str]:
        place = tmp_path_factory.mktemp(name)
        with pytest.MonkeyPatch.context() as here:
            here.chdir(place)
            prepare(place)
            before = tree(place)
            result = ended(*COMMANDS[name])
            assert result.exit_code == 0, result.output
            after = tree(place)
            assert {path: after[path] for path in before} == before
            found = {path: after[path] for path in after.keys() - before.keys()}
            assert found
            return found

    return files
