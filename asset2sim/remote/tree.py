"""A dataset's folders and files behind a URL."""

from collections import defaultdict

from asset2sim.remote.listing import listing_of, objects_below
from asset2sim.remote.store import StoreError, object_info, read_object, usage_error
from asset2sim.tree import Tree
from schemas.errors import UsageError


def remote_tree(url: str) -> Tree:
    """What lies below a URL. Raises UsageError where there is nothing, or the store does not answer."""
    try:
        found = objects_below(listing_of(url), url)
        if not found:
            is_object = object_info(url) is not None
            what = "is an object; name the folder that holds it" if is_object else "holds nothing; is it the right one?"
            raise UsageError(f"no dataset at {url}: it {what}")
    except StoreError as error:
        raise usage_error(error) from error
    files, folders = defaultdict(set), defaultdict(set)
    for name in found:
        *above, last = name.split("/")
        files["/".join(above)].add(last)
        for depth, folder in enumerate(above):
            folders["/".join(above[:depth])].add(folder)

    def read(name: str) -> bytes:
        try:
            return read_object(f"{url}/{name}")
        except StoreError as error:
            raise usage_error(error) from error

    return Tree(
        url,
        lambda folder: sorted(name for name in folders.get(folder, ()) if not name.startswith(".")),
        lambda folder: sorted(files.get(folder, ())),
        read,
    )
