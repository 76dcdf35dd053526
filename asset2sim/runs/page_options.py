"""The options of the commands that show pages, the viewer, the report and what is served together."""

from pydantic import Field
from pydantic_settings import CliPositionalArg, CliToggleFlag

from asset2sim.runs.option_groups import CatalogOptions, FileOptions
from asset2sim.runs.option_types import ENGINE, NAME, PORT, VIEWED, N
from schemas.vocabulary import Engine


class ViewOptions(CatalogOptions, FileOptions):
    """Look at refined objects and touch them, beside the raw ones, and review them: a page on this machine."""

    asset_id: CliPositionalArg[NAME | None] = Field(None, description="the asset to begin with (default: the first)")
    engine: ENGINE = Field(Engine.PYBULLET, description=f"the engine to begin with: {', '.join(VIEWED)}")
    host: NAME = Field("127.0.0.1", description="the address to serve on; others let any machine that reaches it in")
    port: PORT = Field(8080, description="the port to serve on")


class ReportOptions(CatalogOptions, FileOptions):
    """Write the report for people, OUT/report: an index and a page an object, as a run does at its end."""

    workers: N | None = Field(None, description="objects drawn at once (default: all cores)")
    force: CliToggleFlag[bool] = Field(False, description="make every page anew")


class PagesOptions(CatalogOptions):
    """Serve the report and the pages of Prefect and MLflow."""

    report_port: PORT = Field(4100, description="port of 127.0.0.1 for the report")
    prefect_port: PORT = Field(4200, description="port of 127.0.0.1 for Prefect's pages")
    mlflow_port: PORT = Field(5000, description="port of 127.0.0.1 for MLflow's pages")
