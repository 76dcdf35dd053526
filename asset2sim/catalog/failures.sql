-- The failure-mode breakdown: for each method and model, how many assets ended how, and why.
--
-- Reads two tables of the catalog, `assets` (one row per asset, method and model) and `findings` (one row per finding).
-- `none` is the row of the assets that passed. `share_percent` is of all assets of that method and model. `causes` counts
-- the error findings behind each mode, the most frequent first; `example_asset_ids` names up to five assets, and `reason` is
-- that of the first of them.
--
-- By hand, from a catalog folder:
--     duckdb -c "CREATE VIEW assets AS FROM 'assets.parquet'; CREATE VIEW findings AS FROM 'findings.parquet'" -f failures.sql

WITH cause AS (
    SELECT a.method, a.model, a.failure_mode, f.code, count(DISTINCT a.asset_id) AS assets
    FROM assets AS a
    JOIN findings AS f USING (asset_id, method, model)
    WHERE a.status = 'failed' AND f.severity = 'error'
    GROUP BY a.method, a.model, a.failure_mode, f.code
),
causes AS (
    SELECT method, model, failure_mode, string_agg(code || ' ×' || assets, ', ' ORDER BY assets DESC, code) AS causes
    FROM cause
    GROUP BY method, model, failure_mode
),
mode AS (
    SELECT
        method,
        model,
        failure_mode,
        any_value(paper_failure_mode) AS paper_failure_mode,
        count(*) AS assets,
        100.0 * count(*) / sum(count(*)) OVER (PARTITION BY method, model) AS share_percent,
        list(asset_id ORDER BY asset_id)[1:5] AS example_asset_ids,
        arg_min(reason, asset_id) AS reason
    FROM assets
    GROUP BY method, model, failure_mode
)
SELECT
    mode.method,
    mode.model,
    mode.failure_mode,
    mode.paper_failure_mode,
    mode.assets,
    mode.share_percent,
    causes.causes,
    mode.example_asset_ids,
    mode.reason
FROM mode
LEFT JOIN causes USING (method, model, failure_mode)
ORDER BY mode.method, mode.model, mode.failure_mode = 'none' DESC, mode.assets DESC, mode.failure_mode;
