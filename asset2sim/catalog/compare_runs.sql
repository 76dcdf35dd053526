-- What changed between two runs, an asset a row; parameters: the earlier run, the later one. Assets that ended alike in
-- both are left out. `reason` is the later run's, or the earlier one's where the asset was mended or is gone.

WITH before AS (SELECT * FROM asset_history WHERE run_id = ?),
after AS (SELECT * FROM asset_history WHERE run_id = ?),
both_runs AS (
    SELECT
        CASE
            WHEN before.asset_id IS NULL THEN 'came'
            WHEN after.asset_id IS NULL THEN 'went'
            WHEN before.status = 'ok' AND after.status = 'failed' THEN 'broke'
            WHEN before.status = 'failed' AND after.status = 'ok' THEN 'mended'
            WHEN before.failure_mode <> after.failure_mode THEN 'fails otherwise'
        END AS change,
        coalesce(after.asset_id, before.asset_id) AS asset_id,
        coalesce(after.category, before.category) AS category,
        before.failure_mode AS before,
        after.failure_mode AS after,
        CASE WHEN after.status = 'failed' THEN after.reason ELSE before.reason END AS reason
    FROM before
    FULL JOIN after ON before.asset_id = after.asset_id
)
SELECT *
FROM both_runs
WHERE change IS NOT NULL
ORDER BY list_position(['broke', 'fails otherwise', 'mended', 'came', 'went'], change), asset_id;
