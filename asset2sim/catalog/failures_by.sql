-- Failures by a column: how many assets they struck and how often, since when, what they consist of, and for example
-- which assets.
--
-- `{rows}` is `assets` with the start of each row's run, or the part of `asset_history` since a time; `{column}` is a column
-- of both. `share_percent` is of the group's rows, or of all rows where the groups are the failure modes (`{of}`).

WITH every AS (
    SELECT {column} AS grouped, count(*) AS times
    FROM {rows}
    GROUP BY ALL
),
failing AS MATERIALIZED (
    SELECT
        {column} AS grouped, asset_id, {cause} AS cause, count(*) AS times,
        min(started_at) AS first_at, max(started_at) AS last_at
    FROM {rows}
    WHERE failure_mode <> 'none'
    GROUP BY ALL
),
counted AS (
    SELECT
        grouped, count(DISTINCT asset_id) AS assets, sum(times)::BIGINT AS failures, min(first_at) AS first_at,
        max(last_at) AS last_at
    FROM failing
    GROUP BY grouped
),
cause AS (
    SELECT grouped, cause, sum(times) AS times
    FROM failing
    GROUP BY ALL
),
causes AS (
    SELECT grouped, string_agg(cause || ' ×' || times, ', ' ORDER BY times DESC, cause) AS causes
    FROM cause
    GROUP BY grouped
),
struck AS (
    SELECT grouped, asset_id, sum(times) AS times
    FROM failing
    GROUP BY ALL
),
examples AS (
    SELECT grouped, list(asset_id ORDER BY times DESC, asset_id)[1:5] AS example_asset_ids
    FROM struck
    GROUP BY grouped
)
SELECT
    counted.grouped AS {column}, assets, failures, 100.0 * failures / {of} AS share_percent, causes, first_at, last_at,
    example_asset_ids
FROM counted
JOIN every ON every.grouped IS NOT DISTINCT FROM counted.grouped
JOIN causes ON causes.grouped IS NOT DISTINCT FROM counted.grouped
JOIN examples ON examples.grouped IS NOT DISTINCT FROM counted.grouped
ORDER BY failures DESC, assets DESC, {column};
