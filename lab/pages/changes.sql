-- What broke and what was mended since the night before?
WITH night AS (SELECT *, dense_rank() OVER (ORDER BY started_at DESC) AS ago FROM asset_history)
SELECT asset_id, category, last.failure_mode AS before, this.failure_mode AS now
FROM night AS this JOIN night AS last USING (asset_id, category, method, model)
WHERE this.ago = 1 AND last.ago = 2 AND before <> now ORDER BY now = 'none', asset_id LIMIT 8
