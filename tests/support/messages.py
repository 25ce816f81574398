"""What loading scenario files says of their mistakes."""

import pytest

from pipeline.scenario.scenario import BadInput, load


def messages(tmp_path, *texts):
    paths = []
    for i, text in enumerate(texts):
        paths.append(tmp_path / f"{'abc'[i]}.yaml")
        paths[-1].write_text(text)
    with pytest.raises(BadInput) as caught:
        load(paths)
    return str(caught.value).replace(f"{tmp_path}/", "").splitlines()
