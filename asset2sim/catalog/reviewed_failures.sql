-- Every asset that fails, with the latest review of it: nulls where it has none. `current` says whether that review is of
-- the asset as it is now, or of one that was refined again since. The failures that nobody has reviewed come first.

WITH latest AS (
    SELECT *
    FROM reviews
    QUALIFY row_number() OVER (PARTITION BY asset_id, method, model ORDER BY reviewed_at DESC) = 1
)
SELECT
    assets.asset_id,
    assets.method,
    assets.model,
    assets.category,
    assets.failure_mode,
    assets.reason,
    latest.verdict,
    latest.note,
    latest.reviewer,
    latest.reviewed_at,
    coalesce(latest.run_id = assets.run_id, false) AS current
FROM assets
LEFT JOIN latest USING (asset_id, method, model)
WHERE assets.status = 'failed'
ORDER BY current, latest.verdict IS NOT NULL, assets.failure_mode, assets.asset_id, assets.method, assets.model;
